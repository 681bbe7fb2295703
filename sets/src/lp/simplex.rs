//! A dual simplex for boxed variables on a condensed tableau.
//!
//! The rows read Aξ + s = b with |s_i| ≤ δ_i. The tableau T has one row a basic variable and one column a
//! nonbasic one (m × n, so it never grows): x_B = B⁻¹b − T x_N. A pivot exchanges one of each by a
//! rank-one update of T, which is the whole cost and runs along the rows. Columns of slacks with a
//! negligible range can never enter; they stand behind `active`, are still updated, and hold B⁻¹, from
//! which multipliers and refinements are read.
//!
//! A nonbasic variable stands at side·range, side = ±1. For a maximum that is dual feasible when
//! side·reduced ≥ 0, which choosing the side achieves for every basis. One step:
//!
//! 1. the basic variable x_r that exceeds its range most leaves, to the bound it exceeds;
//! 2. the dual step t grows through the breakpoints side_j·reduced_j / a_j, a_j = −sign(x_r)·side_j·T_rj > 0;
//!    at each the infeasibility |x_r| − range_r falls by 2·range_j·a_j, and the column where it would fall
//!    below 0 enters (the long-step ratio test); the columns passed change their side;
//! 3. if the breakpoints end first, no ξ satisfies the rows, and row r of B⁻¹ is the Farkas vector.
//!
//! The breakpoint is found by weighted selection, not by sorting. Nothing here has to be right for the bounds
//! to be: see `certificate`.
//!
//! Where most objective coefficients are 0, as in a sparse set, most reduced costs are 0 too and the dual step
//! does not move. After a run of such steps the smallest-index rule takes over, which cannot cycle but crawls; if
//! it does not end them soon, the objective is perturbed from the basis reached: each reduced cost moves away
//! from 0 on its variable's side by about 1e-12 of the largest objective coefficient, another amount for each
//! variable. Every step then gains. At the optimum the true objective comes back, and what the perturbation
//! made wrong is mended by further steps, perturbed less if they stall again. A cap ends what rounding may still
//! prolong.

use super::breakpoints::{Breakpoint, PIVOT, collect, crossing, step_limit};
use super::certificate::{LANES, Program};
use crate::{List, ops};

/// How far a basic variable may exceed its range for a bound: rows and boxes have coefficients near 1.
pub(super) const FEASIBLE: f64 = 1e-11;

/// The same where a point or a proof of emptiness is sought: a few roundings.
pub(super) const STRICT: f64 = 1e-15;

/// Slacks of a smaller range are treated as fixed: they are within the feasibility tolerance.
pub(super) const FREE_SLACK: f64 = 1e-10;

/// A pivot smaller than this, relative to the largest candidate, is passed over for an earlier breakpoint.
pub(super) const WEAK: f64 = 1e-6;

/// Pivots after which the tableau is rebuilt before the next program.
pub(super) const TIRED: u64 = 400;

/// Pivots without progress after which the smallest-index rule takes over.
pub(super) const STALLED: usize = 30;

/// Pivots without progress after which the objective is perturbed: the smallest-index rule has not ended it soon.
pub(super) const STUCK: usize = 60;

/// By how much a reduced cost is moved, as a share of the largest objective coefficient: the least of it, at
/// the first perturbation of a program and at the later ones.
const PERTURBATIONS: [f64; 3] = [1e-12, 1e-13, 1e-14];

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Primal feasible within tolerance, rows set aside excepted.
    Optimal,
    /// Basic row `row` cannot be brought into its range.
    Infeasible {
        /// The row of the tableau.
        row: usize,
    },
    /// The cap on pivots was reached.
    Capped,
}

/// The tableau and the state of its variables. Variables 0..n are ξ, n.. are the slacks.
#[derive(Clone, Debug, Default)]
pub(super) struct Simplex {
    rows: usize,
    cols: usize,
    stride: usize,
    active: usize,
    tableau: List<f64>,
    /// B⁻¹b.
    right: List<f64>,
    /// The basic variables' values.
    x: List<f64>,
    basis: List<usize>,
    column: List<usize>,
    reduced: List<f64>,
    side: List<f64>,
    range: List<f64>,
    basic_range: List<f64>,
    /// The range of each row's slack.
    slack_range: List<f64>,
    /// Rows set aside: their basic variables have an infinite range for the time being.
    aside: List<usize>,
    /// a_j of the ratio test, one a column.
    slope: List<f64>,
    /// side_j·reduced_j, one a column.
    gap: List<f64>,
    /// The columns that can enter, at the front.
    breakpoints: List<Breakpoint>,
    flips: List<(usize, f64)>,
    pivot_row: List<f64>,
    pivot_column: List<f64>,
    wanted: List<usize>,
    /// Pivots since the tableau was built from the coefficients.
    age: u64,
    /// The largest coefficient of the objective.
    size: f64,
    /// Perturbations of the present objective.
    perturbations: usize,
    /// True while the reduced costs are those of a perturbed objective.
    perturbed: bool,
}

impl Simplex {
    /// The slack basis.
    pub(super) fn start(&mut self, program: &Program) {
        (self.rows, self.cols, self.stride) = (program.rows(), program.cols(), program.stride());
        let (m, n) = (self.rows, self.cols);
        self.tableau.clear();
        self.tableau.extend_from_slice(program.coefficients());
        self.right.clear();
        self.right.extend_from_slice(program.right_side());
        self.basis.clear();
        self.basis.extend(n..n + m);
        self.column.clear();
        self.column.extend(0..n);
        self.slack_range.clear();
        self.slack_range.extend(
            program
                .slack()
                .iter()
                .map(|&d| if d > FREE_SLACK { d } else { 0.0 }),
        );
        self.basic_range.clear();
        self.basic_range.extend_from_slice(&self.slack_range);
        for (v, value) in [
            (&mut self.reduced, 0.0),
            (&mut self.side, 1.0),
            (&mut self.range, 1.0),
        ] {
            v.clear();
            v.resize(self.stride, value);
        }
        for v in [&mut self.pivot_row, &mut self.slope, &mut self.gap] {
            v.clear();
            v.resize(self.stride, 0.0);
        }
        self.breakpoints.clear();
        self.breakpoints.resize(self.stride, Breakpoint::default());
        for v in [&mut self.x, &mut self.pivot_column] {
            v.clear();
            v.resize(m, 0.0);
        }
        self.aside.clear();
        self.active = n;
        self.age = 0;
    }

    /// Builds the tableau of the present basis from the coefficients; returns the pivots that took.
    /// Where the basis has become singular, slacks stay in it.
    pub(super) fn rebuild(&mut self, program: &Program) -> u64 {
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        wanted.extend(self.basis.iter().copied().filter(|&v| v < self.cols));
        wanted.sort_unstable();
        let free_basic: List<usize> = self
            .basis
            .iter()
            .copied()
            .filter(|&v| v >= self.cols)
            .collect();
        self.start(program);
        let mut pivots = 0;
        for &v in &wanted {
            let q = self
                .column
                .iter()
                .position(|&c| c == v)
                .expect("a variable not yet basic has a column");
            let mut best = (0.0, usize::MAX);
            for i in 0..self.rows {
                let leaves = self.basis[i] >= self.cols && !free_basic.contains(&self.basis[i]);
                let size = self.tableau[i * self.stride + q].abs();
                if leaves && size > best.0 {
                    best = (size, i);
                }
            }
            if best.0 > PIVOT {
                ops::pivot(0);
                self.exchange(best.1, q, 1.0);
                pivots += 1;
            }
        }
        self.age = 0;
        self.wanted = wanted;
        pivots
    }

    /// True if enough pivots were made since the last build for rounding to matter.
    pub(super) fn tired(&self) -> bool {
        self.age > TIRED
    }

    /// True if a rebuild would change anything.
    pub(super) fn aged(&self) -> bool {
        self.age > self.rows as u64
    }

    /// Takes the objective `d` (padded): reduced costs, sides and basic values of the present basis.
    pub(super) fn aim(&mut self, d: &[f64]) {
        let n = self.cols;
        self.price(d);
        for &i in &self.aside {
            let v = self.basis[i];
            self.basic_range[i] = if v < n { 1.0 } else { self.slack_range[v - n] };
        }
        self.aside.clear();
        self.recompute_values();
        self.size = d.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        self.perturbations = 0;
    }

    /// The reduced costs of `d` in the present basis, each variable on the side that they ask for.
    fn price(&mut self, d: &[f64]) {
        let n = self.cols;
        self.perturbed = false;
        for (r, &v) in self.reduced.iter_mut().zip(&self.column) {
            *r = if v < n { d[v] } else { 0.0 };
        }
        for i in 0..self.rows {
            let v = self.basis[i];
            let cost = if v < n { d[v] } else { 0.0 };
            if cost != 0.0 {
                let row = &self.tableau[i * self.stride..][..self.stride];
                ops::count(self.stride, self.stride);
                for (r, &t) in self.reduced.iter_mut().zip(row) {
                    *r -= cost * t;
                }
            }
        }
        for (side, &r) in self.side.iter_mut().zip(&self.reduced) {
            // Zero keeps the side it has.
            *side = if r > 0.0 {
                1.0
            } else if r < 0.0 {
                -1.0
            } else {
                *side
            };
        }
    }

    /// Moves every reduced cost away from 0 on its variable's side: by [`PERTURBATIONS`] times 1 to 2, by the
    /// variable's index.
    fn perturb(&mut self) {
        // Of no objective any will do: it is a point that is sought.
        let size = if self.size > 0.0 { self.size } else { 1.0 };
        let least = PERTURBATIONS[self.perturbations] * size;
        let columns = self.column.iter().zip(&self.side).take(self.active);
        for (reduced, (&v, side)) in self.reduced.iter_mut().zip(columns) {
            // Multiples of the golden ratio, modulo 1: no two are alike.
            let spread = f64::from((v as u32).wrapping_mul(0x9E37_79B9)) / 4_294_967_296.0;
            *reduced += side * least * (1.0 + spread);
        }
        self.perturbations += 1;
        self.perturbed = true;
    }

    /// x_B = B⁻¹b − T x_N.
    fn recompute_values(&mut self) {
        ops::count(
            (self.rows + 1) * self.stride,
            self.rows * self.stride.saturating_sub(1) + self.rows,
        );
        for j in 0..self.stride {
            self.pivot_row[j] = self.side[j] * self.range[j];
        }
        self.pivot_row[self.active..].fill(0.0);
        for i in 0..self.rows {
            let row = &self.tableau[i * self.stride..][..self.stride];
            self.x[i] = self.right[i] - dot4(row, &self.pivot_row);
        }
    }

    /// Pivots until the basis is optimal for `d` with `tolerance`, a row turns out infeasible, or the cap; returns
    /// the pivots.
    pub(super) fn run(&mut self, d: &[f64], tolerance: f64) -> (Outcome, u64) {
        let cap = 100 + 20 * (self.rows + self.cols);
        let (mut still, mut pivots) = (0, 0);
        while pivots < cap {
            if still > STUCK && !self.perturbed && self.perturbations < PERTURBATIONS.len() {
                self.perturb();
                still = 0;
            }
            let by_index = still > STALLED;
            let Some(r) = self.leaving(by_index, tolerance) else {
                if !self.perturbed {
                    return (Outcome::Optimal, pivots as u64);
                }
                self.price(d);
                self.recompute_values();
                still = 0;
                continue;
            };
            let Some((q, step)) = self.entering(r, by_index, tolerance) else {
                return (Outcome::Infeasible { row: r }, pivots as u64);
            };
            still = if step > 0.0 { 0 } else { still + 1 };
            // The bound exceeded, before the flips bring x_r closer to it.
            let bound = if self.x[r] > 0.0 { 1.0 } else { -1.0 };
            ops::pivot(self.flips.len());
            self.flip();
            self.exchange(r, q, bound);
            pivots += 1;
        }
        if self.perturbed {
            self.price(d);
            self.recompute_values();
        }
        (Outcome::Capped, cap as u64)
    }

    /// The basic variable that leaves.
    fn leaving(&self, by_index: bool, tolerance: f64) -> Option<usize> {
        let pairs = || self.x.iter().zip(&self.basic_range);
        if by_index {
            let over = pairs()
                .zip(&self.basis)
                .enumerate()
                .filter(|(_, ((x, range), _))| x.abs() - **range > tolerance);
            return over.min_by_key(|(_, (_, v))| **v).map(|(i, _)| i);
        }
        let (x4, r4) = (
            self.x.chunks_exact(LANES),
            self.basic_range.chunks_exact(LANES),
        );
        let mut most = [tolerance; LANES];
        for (x, range) in x4.clone().zip(r4.clone()) {
            for l in 0..LANES {
                let excess = x[l].abs() - range[l];
                most[l] = if excess > most[l] { excess } else { most[l] };
            }
        }
        let mut most = most[0].max(most[1]).max(most[2].max(most[3]));
        for (x, range) in x4.remainder().iter().zip(r4.remainder()) {
            most = most.max(x.abs() - range);
        }
        if most > tolerance {
            pairs().position(|(x, range)| x.abs() - range == most)
        } else {
            None
        }
    }

    /// The column that enters for row `r`, the dual step, and in `flips` the columns passed.
    fn entering(&mut self, r: usize, by_index: bool, tolerance: f64) -> Option<(usize, f64)> {
        self.flips.clear();
        let sign = if self.x[r] > 0.0 { -1.0 } else { 1.0 };
        let active = self.active;
        ops::count(3 * active, 0);
        let row = &self.tableau[r * self.stride..][..active];
        let (side, range, reduced) = (
            &self.side[..active],
            &self.range[..active],
            &self.reduced[..active],
        );
        let (slope, gap) = (&mut self.slope[..active], &mut self.gap[..active]);
        for ((((a, g), &t), &side), &d) in slope
            .iter_mut()
            .zip(gap.iter_mut())
            .zip(row)
            .zip(side)
            .zip(reduced)
        {
            *a = sign * side * t;
            *g = side * d;
        }
        let (slope, gap) = (&*slope, &*gap);
        let excess = self.x[r].abs() - self.basic_range[r];
        // Most steps end within the first few breakpoints: collect only those below a limit.
        let limit = if by_index {
            f64::INFINITY
        } else {
            step_limit(slope, gap, range, excess)
        };
        let (mut count, mut total) = collect(slope, gap, range, limit, &mut self.breakpoints);
        if total < excess && limit < f64::INFINITY {
            (count, total) = collect(slope, gap, range, f64::INFINITY, &mut self.breakpoints);
        }
        // The breakpoints end before x_r is in its range, by more than the tolerance.
        if total < excess - tolerance || count == 0 {
            return None;
        }
        let points = &mut self.breakpoints[..count];
        if by_index {
            let first = points.iter().fold(f64::INFINITY, |m, b| m.min(b.step));
            let column = &self.column;
            let entering = points
                .iter()
                .filter(|b| b.step <= first)
                .min_by_key(|b| column[b.column]);
            return entering.map(|b| (b.column, b.step));
        }
        let at = crossing(points, excess);
        let (mut chosen, passed) = (points[at], &points[..at]);
        // Where the pivot is weak beside one already passed, stop at that earlier step instead.
        let strongest = passed
            .iter()
            .fold(slope[chosen.column], |m, b| m.max(slope[b.column]));
        let mut early = false;
        if slope[chosen.column] < WEAK * strongest {
            for b in passed
                .iter()
                .filter(|b| slope[b.column] >= WEAK * strongest)
            {
                if !early || b.step > chosen.step {
                    chosen = *b;
                    early = true;
                }
            }
        }
        for b in passed.iter().filter(|b| !early || b.step < chosen.step) {
            self.flips
                .push((b.column, 2.0 * side[b.column] * range[b.column]));
        }
        Some((chosen.column, chosen.step))
    }

    /// Moves the columns passed to their other side and the basic values along.
    fn flip(&mut self) {
        if self.flips.is_empty() {
            return;
        }
        ops::count(self.rows * self.flips.len(), self.rows * self.flips.len());
        for &(j, _) in &self.flips {
            self.side[j] = -self.side[j];
        }
        for (x, row) in self
            .x
            .iter_mut()
            .zip(self.tableau.chunks_exact(self.stride))
        {
            let mut change = 0.0;
            for &(j, by) in &self.flips {
                change += row[j] * by;
            }
            *x += change;
        }
    }

    /// Exchanges the basic variable of row `r`, which goes to `bound`·its range, with column `q`.
    fn exchange(&mut self, r: usize, q: usize, bound: f64) {
        let stride = self.stride;
        ops::count(
            (self.rows + 2) * stride + 2 * self.rows + 3,
            (self.rows + 1) * stride + 2 * self.rows + 2,
        );
        // Column q goes to the leaving variable, whose own column is that of the identity.
        for (c, t) in self
            .pivot_column
            .iter_mut()
            .zip(self.tableau[q..].iter_mut().step_by(stride))
        {
            *c = *t;
            *t = 0.0;
        }
        let pivot = self.pivot_column[r];
        let inverse = 1.0 / pivot;
        // Values: x_r moves to its bound, the entering variable by `move_by`.
        let old = self.side[q] * self.range[q];
        let target = bound * self.basic_range[r];
        let move_by = (self.x[r] - target) * inverse;
        let right = self.right[r] * inverse;
        for ((x, b), &c) in self
            .x
            .iter_mut()
            .zip(&mut self.right)
            .zip(&self.pivot_column)
        {
            *x -= c * move_by;
            *b -= c * right;
        }
        self.x[r] = old + move_by;
        self.right[r] = right;
        let row = &mut self.tableau[r * stride..][..stride];
        row[q] = 1.0;
        for (t, p) in row.iter_mut().zip(&mut self.pivot_row) {
            *p = *t * inverse;
            *t = *p;
        }
        self.pivot_column[r] = 0.0;
        rank_one(
            &mut self.tableau,
            &self.pivot_column,
            &self.pivot_row,
            stride,
        );
        let cost = std::mem::replace(&mut self.reduced[q], 0.0);
        for (d, &p) in self.reduced.iter_mut().zip(&self.pivot_row) {
            *d -= cost * p;
        }
        std::mem::swap(&mut self.basis[r], &mut self.column[q]);
        std::mem::swap(&mut self.basic_range[r], &mut self.range[q]);
        self.side[q] = bound;
        if self.range[q] == 0.0 {
            self.retire(q);
        }
        self.age += 1;
    }

    /// Moves the column `q` of a fixed slack behind the active ones.
    fn retire(&mut self, q: usize) {
        let last = self.active - 1;
        if q != last {
            for row in self.tableau.chunks_exact_mut(self.stride) {
                row.swap(q, last);
            }
            self.reduced.swap(q, last);
            self.side.swap(q, last);
            self.range.swap(q, last);
            self.column.swap(q, last);
        }
        self.active = last;
    }

    /// Leaves row `row` alone until the next objective.
    pub(super) fn set_aside(&mut self, row: usize) {
        self.basic_range[row] = f64::INFINITY;
        self.aside.push(row);
    }

    /// True if no row is set aside.
    pub(super) fn complete(&self) -> bool {
        self.aside.is_empty()
    }

    /// y, one a row of the program: minus the reduced costs of the slacks.
    pub(super) fn multipliers(&self, y: &mut [f64]) {
        y.fill(0.0);
        for (&v, &r) in self.column.iter().zip(&self.reduced) {
            if v >= self.cols {
                y[v - self.cols] = -r;
            }
        }
    }

    /// y += B⁻ᵀ v_B, for v = d − Aᵀy.
    pub(super) fn refine_multipliers(&self, v: &[f64], y: &mut [f64]) {
        for (i, &b) in self.basis.iter().enumerate() {
            let defect = if b < self.cols {
                v[b]
            } else {
                -y[b - self.cols]
            };
            if defect == 0.0 {
                continue;
            }
            let row = &self.tableau[i * self.stride..][..self.cols];
            for (&c, &t) in self.column.iter().zip(row) {
                if c >= self.cols {
                    y[c - self.cols] += defect * t;
                }
            }
            if b >= self.cols {
                y[b - self.cols] = 0.0;
            }
        }
    }

    /// Row `row` of B⁻¹, with the sign of the Farkas inequality bᵀy > ‖Aᵀy‖₁ + |y|ᵀδ.
    pub(super) fn farkas(&self, row: usize, y: &mut [f64]) {
        let sign = if self.x[row] > 0.0 { 1.0 } else { -1.0 };
        y.fill(0.0);
        let t = &self.tableau[row * self.stride..][..self.cols];
        for (&v, &t) in self.column.iter().zip(t) {
            if v >= self.cols {
                y[v - self.cols] = sign * t;
            }
        }
        if self.basis[row] >= self.cols {
            y[self.basis[row] - self.cols] = sign;
        }
    }

    /// Σ|v_j| over the basic ξ.
    pub(super) fn basic_abs_sum(&self, v: &[f64]) -> f64 {
        self.basis
            .iter()
            .filter(|&&b| b < self.cols)
            .fold(0.0, |s, &b| s + v[b].abs())
    }

    /// dᵀξ at the present vertex.
    pub(super) fn objective(&self, d: &[f64]) -> f64 {
        let mut value = 0.0;
        for j in 0..self.active {
            if self.column[j] < self.cols {
                value += d[self.column[j]] * self.side[j];
            }
        }
        for (&b, &x) in self.basis.iter().zip(&self.x) {
            if b < self.cols {
                value += d[b] * x;
            }
        }
        value
    }

    /// The present ξ, clamped to |ξ| ≤ 1.
    pub(super) fn point(&self, xi: &mut List<f64>) {
        xi.clear();
        xi.resize(self.cols, 0.0);
        for j in 0..self.active {
            if self.column[j] < self.cols {
                xi[self.column[j]] = self.side[j];
            }
        }
        for (&b, &x) in self.basis.iter().zip(&self.x) {
            if b < self.cols {
                xi[b] = x.clamp(-1.0, 1.0);
            }
        }
    }

    /// ξ_B += B⁻¹ r for r = b − Aξ, clamped.
    pub(super) fn refine_point(&self, r: &[f64], xi: &mut [f64]) {
        for (i, &b) in self.basis.iter().enumerate() {
            if b >= self.cols {
                continue;
            }
            let row = &self.tableau[i * self.stride..][..self.cols];
            let mut change = 0.0;
            for (&c, &t) in self.column.iter().zip(row) {
                if c >= self.cols {
                    change += t * r[c - self.cols];
                }
            }
            xi[b] = (xi[b] + change).clamp(-1.0, 1.0);
        }
    }
}

/// T −= column rowᵀ, four rows of T at a time.
fn rank_one(tableau: &mut [f64], column: &[f64], row: &[f64], stride: usize) {
    let row = &row[..stride];
    let mut blocks = tableau.chunks_exact_mut(4 * stride);
    let mut factors = column.chunks_exact(4);
    for (block, f) in blocks.by_ref().zip(factors.by_ref()) {
        let (t0, rest) = block.split_at_mut(stride);
        let (t1, rest) = rest.split_at_mut(stride);
        let (t2, t3) = rest.split_at_mut(stride);
        let (f0, f1, f2, f3) = (f[0], f[1], f[2], f[3]);
        for ((((&p, t0), t1), t2), t3) in row.iter().zip(t0).zip(t1).zip(t2).zip(t3) {
            *t0 -= f0 * p;
            *t1 -= f1 * p;
            *t2 -= f2 * p;
            *t3 -= f3 * p;
        }
    }
    for (t, &f) in blocks
        .into_remainder()
        .chunks_exact_mut(stride)
        .zip(factors.remainder())
    {
        for (t, &p) in t.iter_mut().zip(row) {
            *t -= f * p;
        }
    }
}

/// Σ a_i b_i in four lanes, for lengths that are multiples of [`LANES`].
fn dot4(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for l in 0..LANES {
            lanes[l] += a[l] * b[l];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}
