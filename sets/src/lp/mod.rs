//! Linear programs over a box cut by a few equations, with bounds that are proved.
//!
//! Every question about a constrained zonotope (hull, support, membership, emptiness) is
//!
//! max dᵀξ  subject to  |Aξ − b| ≤ δ, |ξ| ≤ 1,
//!
//! with few rows, some more columns, and many directions d over the same rows. [`LinearProgram`]
//! holds the rows and the direction, each scaled by a power of two (which is exact), and solves with a bounded dual
//! simplex that keeps its basis from one direction to the next: on a tableau (`simplex`), or, where rows are many and have
//! few entries, taken apart (`parts`) and on an inverse of the basis (`revised`). What it reports is never
//! the simplex's own objective: it is a bound computed from the multipliers y alone (`certificate`),
//! valid for any y, so a bad pivot, drift or an early stop can only make it wider.
//!
//! Where the simplex gives up, an interior-point solver is asked (`second_opinion`), and its multipliers
//! pass through the same certificate.
//!
//! The box makes every basis dual feasible once the nonbasic variables stand on the right side, so
//! there is no first phase and every iterate carries a usable y.

mod breakpoints;
mod certificate;
mod compressed;
mod parts;
mod revised;
mod second_opinion;
mod simplex;

use crate::matrix::abs_sum;
use crate::{List, Matrix, SetError, ops, rounding};
use certificate::{Program, row_scale};
use parts::{Ended, Parts};
use simplex::{FEASIBLE, STRICT};

/// Work done by a [`LinearProgram`] since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Directions maximised.
    pub programs: u64,
    /// Simplex pivots, those of rebuilt tableaus included.
    pub pivots: u64,
    /// Tableaus rebuilt from the coefficients because rounding had built up.
    pub rebuilds: u64,
    /// Programs in which the simplex gave up before its optimum.
    pub unfinished: u64,
    /// Programs given to the interior-point solver besides. Its bits may depend on the processor: a table
    /// that is to be the same everywhere shows 0 here.
    pub fallbacks: u64,
}

/// Whether { |ξ| ≤ 1, |Aξ − b| ≤ δ } is empty, as far as it can be proved.
#[derive(Clone, Debug, PartialEq)]
pub enum Emptiness {
    /// Proved empty: some y has bᵀy − ‖Aᵀy‖₁ − |y|ᵀδ > 0 after all rounding is charged.
    Empty,
    /// A point ξ with |ξ| ≤ 1 and |Aξ − b| ≤ δ + σ was verified, where
    /// σ_i = 2γ_{n+2}(|A_i|1 + |b_i|) + 2η is the rounding of checking row i, η as it is in the row scaled by the power of
    /// two that brings its largest coefficient near 1.
    NonEmpty(List<f64>),
    /// Neither could be proved.
    Undecided {
        /// By how much the best point misses its rows' slack δ + σ, each row divided by its largest
        /// coefficient (within a factor 2).
        margin: f64,
    },
}

/// A certified answer about one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Maximum {
    /// An upper bound on max dᵀξ, proved from the multipliers.
    pub upper: f64,
    /// The simplex reached its optimum: `upper` is then the maximum up to rounding. If not, `upper` is
    /// valid all the same.
    pub optimal: bool,
}

/// The programs max dᵀξ subject to |Aξ − b| ≤ δ, |ξ| ≤ 1 for one A, b, δ and many d.
///
/// Buffers are kept: after the first program of a shape nothing is allocated.
#[derive(Clone, Debug, Default)]
pub struct LinearProgram {
    program: Program,
    parts: Parts,
    multipliers: List<f64>,
    /// d − Aᵀy, one entry a column.
    residual: List<f64>,
    /// The power of two that the present direction was multiplied by: tolerances are about coefficients near 1.
    direction_scale: f64,
    /// b − Aξ, one entry a row.
    row_residual: List<f64>,
    direction: List<f64>,
    point: List<f64>,
    /// Set once a Farkas vector has been certified for the rows loaded.
    proved_empty: bool,
    work: Work,
}

impl LinearProgram {
    /// An engine without rows.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the rows |Aξ − b| ≤ δ (A m × n, b and δ of length m) and starts from the slack basis.
    ///
    /// Fails if the shapes differ, a coefficient is not finite, or a δ is negative.
    pub fn load(&mut self, a: &Matrix, b: &[f64], delta: &[f64]) -> Result<(), SetError> {
        self.program.load(a, b, delta)?;
        self.program.list();
        self.resize();
        self.proved_empty = self.parts.start(&self.program);
        Ok(())
    }

    /// As [`LinearProgram::load`], but starts from the basis of the rows held before, where it fits:
    /// for the next step of a recursion, whose rows have the same shape and similar coefficients. Large programs with
    /// few entries start anew.
    pub fn load_warm(&mut self, a: &Matrix, b: &[f64], delta: &[f64]) -> Result<(), SetError> {
        let same_shape = (self.program.rows(), self.program.cols()) == (a.rows(), a.cols());
        self.program.load(a, b, delta)?;
        self.program.list();
        self.resize();
        if same_shape {
            let (empty, pivots) = self.parts.start_warm(&self.program);
            self.work.pivots += pivots;
            self.proved_empty = empty;
        } else {
            self.proved_empty = self.parts.start(&self.program);
        }
        Ok(())
    }

    fn resize(&mut self) {
        self.multipliers.clear();
        self.multipliers.resize(self.program.rows(), 0.0);
        self.residual.clear();
        self.residual.resize(self.program.stride(), 0.0);
        self.direction.clear();
        self.direction.resize(self.program.stride(), 0.0);
        self.direction_scale = 1.0;
        self.proved_empty = false;
    }

    /// Number of rows m.
    pub fn rows(&self) -> usize {
        self.program.rows()
    }

    /// Number of variables n.
    pub fn cols(&self) -> usize {
        self.program.cols()
    }

    /// The work done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// An upper bound on max dᵀξ over the rows loaded, or `Empty` if the set is proved empty.
    ///
    /// U = bᵀy + |y|ᵀδ + ‖d − Aᵀy‖₁ + e for the multipliers y that the simplex ends with, and never
    /// more than ⌈‖d‖₁⌉. Valid whatever the simplex did; see `certificate` for e.
    ///
    /// Source: Neumaier and Shcherbina, Safe bounds in linear and mixed-integer linear programming (2004).
    pub fn maximize(&mut self, d: &[f64]) -> Result<Maximum, SetError> {
        const OP: &str = "linear program";
        if d.len() != self.cols() {
            return Err(SetError::Dimension {
                op: OP,
                expected: self.cols(),
                got: d.len(),
            });
        }
        if let Some(&value) = d.iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        self.direction_scale = row_scale(d, 0.0, 0.0);
        for (t, &x) in self.direction.iter_mut().zip(d) {
            *t = x * self.direction_scale;
        }
        self.work.programs += 1;
        let _kernel = ops::kernel(ops::Kernel::Program);
        ops::program(self.rows(), self.cols());
        if self.cols() == 0 && self.emptiness_of_constants(&[]) == Emptiness::Empty {
            self.proved_empty = true;
        }
        if self.proved_empty {
            return Err(SetError::Empty { op: OP });
        }
        if self.cols() == 0 {
            return Ok(Maximum {
                upper: 0.0,
                optimal: true,
            });
        }
        let mut optimal = self.solve(FEASIBLE).optimal;
        if self.proved_empty {
            return Err(SetError::Empty { op: OP });
        }
        let mut upper = self.certified();
        // Drift shows as a gap between the certified bound and the value at the vertex: rebuild, once.
        let gap = upper - self.parts.objective(&self.direction);
        let closed = gap <= REBUILD_GAP * (1.0 + upper.abs());
        if !closed && self.parts.aged() {
            self.rebuild();
            optimal = self.solve(FEASIBLE).optimal;
            if self.proved_empty {
                return Err(SetError::Empty { op: OP });
            }
            upper = upper.min(self.certified());
        }
        if !optimal {
            self.work.unfinished += 1;
            ops::unfinished();
            upper = upper.min(self.fallback()?);
        }
        Ok(Maximum {
            upper: unscaled_up(upper, self.direction_scale),
            optimal,
        })
    }

    /// Runs the simplex on `direction`.
    fn solve(&mut self, tolerance: f64) -> Ended {
        let ended = self.parts.solve(
            &self.program,
            &self.direction,
            tolerance,
            &mut self.multipliers,
            &mut self.residual,
        );
        self.work.pivots += ended.pivots;
        self.work.rebuilds += ended.rebuilds;
        self.proved_empty |= ended.empty;
        ended
    }

    /// The bound by the interior-point solver's multipliers for the present direction, +∞ if it fails.
    fn fallback(&mut self) -> Result<f64, SetError> {
        self.work.fallbacks += 1;
        ops::fallback();
        let Some(opinion) = second_opinion::consult(&self.program, &self.direction) else {
            return Ok(f64::INFINITY);
        };
        if !opinion.infeasible {
            return Ok(self.program.upper_bound(
                &self.direction,
                &opinion.multipliers,
                &mut self.residual,
            ));
        }
        if self
            .program
            .farkas(&opinion.multipliers, &mut self.residual)
            > 0.0
        {
            self.proved_empty = true;
            return Err(SetError::Empty {
                op: "linear program",
            });
        }
        Ok(f64::INFINITY)
    }

    /// As [`LinearProgram::maximize`], by the interior-point solver alone and through the same
    /// certificate: a second opinion, some hundred times slower.
    pub fn maximize_by_interior_point(&mut self, d: &[f64]) -> Result<f64, SetError> {
        const OP: &str = "linear program";
        if d.len() != self.cols() {
            return Err(SetError::Dimension {
                op: OP,
                expected: self.cols(),
                got: d.len(),
            });
        }
        self.direction[..d.len()].copy_from_slice(d);
        self.direction_scale = 1.0;
        Ok(self.fallback()?.min(rounding::up(abs_sum(d), d.len())))
    }

    fn rebuild(&mut self) {
        self.work.pivots += self.parts.rebuild(&self.program);
        self.work.rebuilds += 1;
    }

    /// The certified bound from the simplex's multipliers, refined once if its basis has drifted.
    fn certified(&mut self) -> f64 {
        self.parts
            .multipliers(&self.program, &self.direction, &mut self.multipliers);
        let (upper, defect) = self.bound();
        if defect <= REFINE_DEFECT * (1.0 + upper.abs()) {
            return upper;
        }
        self.parts.refine_multipliers(
            &self.program,
            &self.direction,
            &self.residual,
            &mut self.multipliers,
        );
        upper.min(self.bound().0)
    }

    /// The bound for the present multipliers, and Σ|d − Aᵀy| over the basic columns, which exact
    /// arithmetic would make 0.
    fn bound(&mut self) -> (f64, f64) {
        let upper =
            self.program
                .upper_bound(&self.direction, &self.multipliers, &mut self.residual);
        (upper, self.parts.basic_abs_sum(&self.residual))
    }

    /// The upper bound on max dᵀξ that the multipliers `y` prove, whoever found them: one a row, in the
    /// units of the rows loaded. Fails with `Dimension`.
    pub fn bound_by(&mut self, d: &[f64], y: &[f64]) -> Result<f64, SetError> {
        const OP: &str = "bound by multipliers";
        for (expected, got) in [(self.cols(), d.len()), (self.rows(), y.len())] {
            if expected != got {
                return Err(SetError::Dimension {
                    op: OP,
                    expected,
                    got,
                });
            }
        }
        self.direction[..d.len()].copy_from_slice(d);
        self.direction_scale = 1.0;
        self.program.scaled(y, &mut self.multipliers);
        Ok(self
            .program
            .upper_bound(&self.direction, &self.multipliers, &mut self.residual))
    }

    /// Whether { |ξ| ≤ 1, |Aξ − b| ≤ δ } is empty: by a certified Farkas vector, by a verified point, or
    /// undecided.
    pub fn emptiness(&mut self) -> Emptiness {
        let margin = match self.point_with_reserve(&[]) {
            Emptiness::Undecided { margin } => margin,
            decided => return decided,
        };
        match self.emptiness_by_second_opinion(&[]) {
            Emptiness::Undecided { margin: other } => Emptiness::Undecided {
                margin: margin.min(other),
            },
            decided => decided,
        }
    }

    /// As [`LinearProgram::emptiness`], by the interior-point solver alone; a point counts only if it keeps
    /// |Aξ − b| + reserve ≤ δ + σ.
    ///
    /// Of no objective: its points are then far from all ends, where there is most to keep in reserve.
    pub(crate) fn emptiness_by_second_opinion(&mut self, reserve: &[f64]) -> Emptiness {
        let mut margin = f64::INFINITY;
        if self.cols() == 0 {
            return Emptiness::Undecided { margin };
        }
        self.work.fallbacks += 1;
        ops::fallback();
        self.direction.fill(0.0);
        if let Some(opinion) = second_opinion::consult(&self.program, &self.direction) {
            if opinion.infeasible
                && self
                    .program
                    .farkas(&opinion.multipliers, &mut self.residual)
                    > 0.0
            {
                self.proved_empty = true;
                return Emptiness::Empty;
            }
            let point: List<f64> = opinion.point.iter().map(|x| x.clamp(-1.0, 1.0)).collect();
            margin = self
                .program
                .missing(&point, reserve, &mut self.row_residual);
            if margin <= 0.0 {
                return Emptiness::NonEmpty(point);
            }
        }
        Emptiness::Undecided { margin }
    }

    /// As [`LinearProgram::emptiness`], by the simplex alone; a point counts only if it keeps
    /// |Aξ − b| + reserve ≤ δ + σ.
    pub(crate) fn point_with_reserve(&mut self, reserve: &[f64]) -> Emptiness {
        if self.cols() == 0 {
            return self.emptiness_of_constants(reserve);
        }
        if self.proved_empty {
            return Emptiness::Empty;
        }
        // Any direction does; one without ties keeps the dual simplex from stalling.
        let n = self.cols();
        self.direction_scale = 1.0;
        for (j, d) in self.direction[..n].iter_mut().enumerate() {
            let wave = ((j * 37 + 11) % 64) as f64 / 64.0 - 0.4921875;
            *d = wave;
        }
        self.work.programs += 1;
        let _kernel = ops::kernel(ops::Kernel::Program);
        ops::program(self.rows(), n);
        let mut margin = f64::INFINITY;
        for tolerance in [FEASIBLE, STRICT] {
            if tolerance == STRICT {
                self.rebuild();
            }
            let ended = self.solve(tolerance);
            if self.proved_empty {
                return Emptiness::Empty;
            }
            if ended.capped {
                self.work.unfinished += 1;
                ops::unfinished();
            }
            self.parts.point(&self.direction, &mut self.point);
            for _ in 0..3 {
                let missing = self
                    .program
                    .missing(&self.point, reserve, &mut self.row_residual);
                margin = margin.min(missing);
                if missing <= 0.0 {
                    return Emptiness::NonEmpty(self.point.clone());
                }
                self.parts.refine_point(&self.row_residual, &mut self.point);
            }
        }
        Emptiness::Undecided { margin }
    }

    /// Emptiness without a column: each row says |b_i| ≤ δ_i.
    fn emptiness_of_constants(&mut self, reserve: &[f64]) -> Emptiness {
        for i in 0..self.rows() {
            self.multipliers.fill(0.0);
            self.multipliers[i] = self.program.right_side()[i].signum();
            if self.program.farkas(&self.multipliers, &mut self.residual) > 0.0 {
                self.proved_empty = true;
                return Emptiness::Empty;
            }
        }
        self.multipliers.fill(0.0);
        let margin = self.program.missing(&[], reserve, &mut self.row_residual);
        if margin <= 0.0 {
            Emptiness::NonEmpty(List::new())
        } else {
            Emptiness::Undecided { margin }
        }
    }

    /// Whether |Aξ − b| + reserve ≤ δ + σ was verified for this ξ, |ξ| ≤ 1, with the σ of
    /// [`Emptiness::NonEmpty`].
    pub(crate) fn verifies(&mut self, xi: &[f64], reserve: &[f64]) -> bool {
        xi.len() == self.cols()
            && xi.iter().all(|x| x.abs() <= 1.0)
            && self.program.missing(xi, reserve, &mut self.row_residual) <= 0.0
    }

    /// The multipliers y of the last program, one a row, in the units of the rows loaded.
    pub fn multipliers(&self) -> Vec<f64> {
        let mut y = self.program.unscaled(&self.multipliers);
        y.iter_mut().for_each(|y| *y /= self.direction_scale);
        y
    }

    /// The point ξ that the simplex ended with: a vertex up to rounding, clamped to |ξ| ≤ 1. Not a proof
    /// of anything; [`LinearProgram::emptiness`] verifies its point.
    pub fn point(&mut self) -> &[f64] {
        self.parts.point(&self.direction, &mut self.point);
        &self.point
    }
}

/// ⌈`upper`/`scale`⌉ for a power of two: exact unless it underflows.
fn unscaled_up(upper: f64, scale: f64) -> f64 {
    let own = upper / scale;
    if own.is_finite() && own * scale < upper {
        own.next_up()
    } else {
        own
    }
}

/// A relative gap between the certified bound and the vertex above which the tableau is rebuilt. It is measured in the
/// scaled direction, whose largest coefficient is in [1, 2): in 1 + |U| both have its unit.
const REBUILD_GAP: f64 = 1e-11;

/// A relative defect of the basic columns above which the multipliers are refined.
const REFINE_DEFECT: f64 = 1e-13;
