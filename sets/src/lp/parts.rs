//! A program taken apart before it is solved, and its answers put together again.
//!
//! What is done is exact for |Aξ − b| ≤ δ, |ξ| ≤ 1:
//!
//! * A row with one coefficient, |a ξ_j − b_i| ≤ δ_i, is a range of ξ_j and leaves. Where the range is a point, ξ_j is put
//!   into its other rows and leaves too, and they may have one coefficient then.
//! * A ξ_j in no row stands at the end that its coefficient of d asks for.
//! * Rows that share no ξ, not even by way of others, are programs apart: the maximum is the sum of theirs. A direction that
//!   is 0 on all ξ of one leaves it alone, once it is known not to be empty.
//!
//! Each part is solved over ζ ∈ \[−1, 1\], ξ_j = m_j + h_j ζ_j, by a tableau if it is small or has many entries, else
//! by an inverse of its basis. Programs that are small or have many entries altogether are not taken apart.
//!
//! **Multipliers.** Those of the rows that stayed are the parts'. With them v_j = d_j − Σ_k y_k a_kj over the other rows of ξ_j,
//! and row i, which bounds it on the side of v_j, takes y_i = v_j/a: then d_j − (Aᵀy)_j = 0 and
//! y_i b_i + |y_i| δ_i = |v_j| (sign(v_j) b_i/a + δ_i/|a|) = v_j times the end of the range, in place of |v_j|·1. Ranges of ξ
//! that stayed come first, since their v_j depend on rows that stayed only; then the ξ put in, the last one first, since
//! rows that left because of ξ_j came after it. The same steps with d = 0 make a Farkas vector of the rows that stayed one of
//! all rows, and two rows whose ranges of ξ_j do not meet, with 1/a and −1/a, are one to begin with. All of this only proposes
//! y: what is claimed is computed from y and the rows as they were loaded (`certificate`), so no step here is
//! part of a proof.

use super::certificate::{Program, row_scale};
use super::compressed::{Compressed, Lines};
use super::revised::Revised;
use super::simplex::{Outcome, Simplex};
use crate::{List, Matrix};

/// A part with fewer coefficients, zeros among them, keeps a tableau.
const SMALL: usize = 1500;

/// A part in which more than one coefficient in so many is not 0 keeps a tableau.
const SPARSE: usize = 6;

/// A range of ξ narrower than this is a point.
const POINT: f64 = 1e-12;

/// A smaller coefficient, in a row scaled to a largest one near 1, is not divided by.
const DIVISOR: f64 = 1e-6;

/// A tableau or an inverse.
#[derive(Clone, Debug)]
enum Engine {
    Tableau(Box<Simplex>),
    Inverse(Box<Revised>),
}

/// The same call to either.
macro_rules! either {
    ($engine:expr, $own:ident => $call:expr) => {
        match $engine {
            Engine::Tableau($own) => $call,
            Engine::Inverse($own) => $call,
        }
    };
}

/// Rows and columns that share nothing with the others.
#[derive(Clone, Debug)]
struct Part {
    rows: List<usize>,
    cols: List<usize>,
    /// The power of two that each row is multiplied by.
    scale: List<f64>,
    program: Program,
    engine: Engine,
    /// The direction along ζ, padded.
    direction: List<f64>,
    /// Multipliers of the part's rows; also right sides.
    y: List<f64>,
    /// A vector along ζ.
    v: List<f64>,
    /// Solved once, so known not to be proved empty.
    known: bool,
    /// The present direction concerns it.
    asked: bool,
}

/// A column that rows with one coefficient bound, and those rows with their coefficient.
#[derive(Clone, Copy, Debug)]
struct Range {
    column: usize,
    lower: Option<(usize, f64)>,
    upper: Option<(usize, f64)>,
}

/// How a direction ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ended {
    /// Every part reached its optimum, none with rows set aside.
    pub(super) optimal: bool,
    /// A part reached the cap on pivots.
    pub(super) capped: bool,
    /// Proved empty.
    pub(super) empty: bool,
    pub(super) pivots: u64,
    pub(super) rebuilds: u64,
}

/// The parts of a program.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    /// Of a program that is not taken apart.
    whole: Simplex,
    apart: bool,
    parts: Vec<Part>,
    middle: List<f64>,
    half: List<f64>,
    /// In the order in which multipliers are put back.
    ranges: List<Range>,
    /// Columns in no part.
    single: List<usize>,
}

impl Parts {
    /// Takes the rows; true if they are proved empty.
    pub(super) fn start(&mut self, program: &Program) -> bool {
        self.apart = false;
        self.parts.clear();
        if let Some(entries) = program.entries() {
            let mut taken = Presolve::of(program, entries);
            let empty = taken.reduce();
            self.apart = self.take(program, entries, taken);
            if empty {
                return true;
            }
        }
        if !self.apart {
            self.whole.start(program);
        }
        false
    }

    /// As [`Parts::start`] for rows of the shape of those before, from their basis where they are not taken apart; the
    /// pivots that took.
    pub(super) fn start_warm(&mut self, program: &Program) -> (bool, u64) {
        if self.apart || program.entries().is_some() {
            (self.start(program), 0)
        } else {
            (false, self.whole.rebuild(program))
        }
    }

    /// The parts of what is left; false if that is all of a program for a tableau.
    fn take(&mut self, program: &Program, entries: &Compressed, taken: Presolve<'_>) -> bool {
        let (blocks, single) = taken.blocks();
        let all = blocks.len() == 1
            && blocks[0].0.len() == program.rows()
            && blocks[0].1.len() == program.cols();
        let tableau = |rows: usize, cols: usize, count: usize| {
            rows * cols < SMALL || SPARSE * count > rows * cols
        };
        let touched = taken.fixed.iter().any(|f| *f) || taken.ranges.iter().any(Option::is_some);
        if all && !touched && tableau(program.rows(), program.cols(), entries.rows.entries()) {
            return false;
        }
        self.middle = taken.ends.iter().map(|(lo, hi)| 0.5 * (lo + hi)).collect();
        self.half = taken.ends.iter().map(|(lo, hi)| 0.5 * (hi - lo)).collect();
        self.single = single;
        let mut place = List::filled(0, program.cols());
        for (rows, cols) in blocks {
            for (k, &j) in cols.iter().enumerate() {
                place[j] = k;
            }
            let (fixed, half, place) = (&taken.fixed, &self.half, &place);
            let line = |i: usize| {
                let free = entries.rows.line(i).filter(|(j, _)| !fixed[*j]);
                free.map(|(j, a)| (place[j], a * half[j]))
            };
            let middle = |i: usize| {
                let free = entries.rows.line(i).filter(|(j, _)| !fixed[*j]);
                free.fold(0.0, |s, (j, a)| s + a * self.middle[j])
            };
            let count = rows.iter().map(|&i| line(i).count()).sum();
            let b: List<f64> = rows.iter().map(|&i| taken.right[i] - middle(i)).collect();
            let delta: List<f64> = rows.iter().map(|&i| program.slack()[i]).collect();
            let mut own = Program::default();
            let (engine, scale) = if tableau(rows.len(), cols.len(), count) {
                let mut a = Matrix::zeros(rows.len(), cols.len());
                for (k, &i) in rows.iter().enumerate() {
                    line(i).for_each(|(j, x)| a[(k, j)] = x);
                }
                if own.load(&a, &b, &delta).is_err() {
                    // Only an overflow: nothing is taken apart then.
                    return false;
                }
                let mut simplex = Simplex::default();
                simplex.start(&own);
                (
                    Engine::Tableau(Box::new(simplex)),
                    own.scales().iter().copied().collect(),
                )
            } else {
                let scale: List<f64> = rows
                    .iter()
                    .map(|&i| {
                        let row: List<f64> = line(i).map(|(_, x)| x).collect();
                        row_scale(&row, 0.0, 0.0)
                    })
                    .collect();
                let mut a = Compressed::default();
                a.fill(rows.len(), cols.len(), |k| {
                    let by = scale[k];
                    line(rows[k]).map(move |(j, x)| (j, x * by))
                });
                let times = |v: &[f64]| v.iter().zip(&scale).map(|(x, s)| x * s).collect();
                let (b, delta): (List<f64>, List<f64>) = (times(&b), times(&delta));
                let mut revised = Revised::default();
                revised.start(a, &b, &delta);
                (Engine::Inverse(Box::new(revised)), scale)
            };
            let padded = own.stride().max(cols.len());
            self.parts.push(Part {
                direction: List::filled(0.0, padded),
                y: List::filled(0.0, rows.len()),
                v: List::filled(0.0, padded),
                rows,
                cols,
                scale,
                program: own,
                engine,
                known: false,
                asked: false,
            });
        }
        self.ranges = taken.order();
        true
    }

    /// Solves for the direction `d`. A row that no point satisfies is tried as a proof of emptiness and otherwise set
    /// aside for this direction. `y` and `v` are used.
    pub(super) fn solve(
        &mut self,
        program: &Program,
        d: &[f64],
        tolerance: f64,
        y: &mut [f64],
        v: &mut [f64],
    ) -> Ended {
        let mut ended = Ended {
            optimal: true,
            ..Ended::default()
        };
        if !self.apart {
            if self.whole.tired() {
                ended.pivots += self.whole.rebuild(program);
                ended.rebuilds += 1;
            }
            self.whole.aim(d);
            loop {
                let (outcome, pivots) = self.whole.run(d, tolerance);
                ended.pivots += pivots;
                let Outcome::Infeasible { row } = outcome else {
                    ended.capped = outcome == Outcome::Capped;
                    ended.optimal = !ended.capped && self.whole.complete();
                    return ended;
                };
                self.whole.farkas(row, y);
                if program.farkas(y, v) > 0.0 {
                    ended.empty = true;
                    return ended;
                }
                self.whole.set_aside(row);
            }
        }
        for p in 0..self.parts.len() {
            let part = &mut self.parts[p];
            part.aim(d, &self.half);
            if !part.asked {
                continue;
            }
            if either!(&part.engine, own => own.tired()) {
                ended.pivots += part.rebuild();
                ended.rebuilds += 1;
            }
            let direction = &part.direction;
            either!(&mut part.engine, own => own.aim(direction));
            let mut renewed = false;
            loop {
                let part = &mut self.parts[p];
                let direction = &part.direction;
                let (outcome, pivots) =
                    either!(&mut part.engine, own => own.run(direction, tolerance));
                ended.pivots += pivots;
                let Outcome::Infeasible { row } = outcome else {
                    let complete = either!(&part.engine, own => own.complete());
                    ended.capped |= outcome == Outcome::Capped;
                    ended.optimal &= outcome == Outcome::Optimal && complete;
                    part.known = true;
                    break;
                };
                let own_y = &mut part.y;
                either!(&part.engine, own => own.farkas(row, own_y));
                y.fill(0.0);
                // Put back for the maximum of 0, whose multipliers are those of the proof with the other sign.
                for ((&i, own), scale) in part.rows.iter().zip(own_y.iter()).zip(&part.scale) {
                    y[i] = -own * scale;
                }
                put_back(columns(program), &self.ranges, |_| 0.0, y);
                y.iter_mut().for_each(|y| *y = -*y);
                if program.farkas(y, v) > 0.0 {
                    ended.empty = true;
                    return ended;
                }
                let part = &mut self.parts[p];
                if !renewed && either!(&part.engine, own => own.aged()) {
                    // What seems infeasible may be what rounding has left of the basis.
                    renewed = true;
                    ended.pivots += part.rebuild();
                    ended.rebuilds += 1;
                    let direction = &part.direction;
                    either!(&mut part.engine, own => own.aim(direction));
                } else {
                    either!(&mut part.engine, own => own.set_aside(row));
                }
            }
        }
        ended
    }

    /// True if a rebuild would change anything.
    pub(super) fn aged(&self) -> bool {
        if !self.apart {
            return self.whole.aged();
        }
        let mut asked = self.parts.iter().filter(|p| p.asked);
        asked.any(|p| either!(&p.engine, own => own.aged()))
    }

    /// Rebuilds from the coefficients what the last direction concerned; the pivots that took.
    pub(super) fn rebuild(&mut self, program: &Program) -> u64 {
        if !self.apart {
            return self.whole.rebuild(program);
        }
        let asked = self.parts.iter_mut().filter(|p| p.asked);
        asked.map(Part::rebuild).sum()
    }

    /// y, one a row of the program.
    pub(super) fn multipliers(&mut self, program: &Program, d: &[f64], y: &mut [f64]) {
        if !self.apart {
            self.whole.multipliers(y);
            return;
        }
        y.fill(0.0);
        for part in self.parts.iter_mut().filter(|p| p.asked) {
            let own_y = &mut part.y;
            either!(&part.engine, own => own.multipliers(own_y));
            part.give(y);
        }
        put_back(columns(program), &self.ranges, |j| d[j], y);
    }

    /// y moved so that the basic columns of v = d − Aᵀy become 0.
    pub(super) fn refine_multipliers(
        &mut self,
        program: &Program,
        d: &[f64],
        v: &[f64],
        y: &mut [f64],
    ) {
        if !self.apart {
            self.whole.refine_multipliers(v, y);
            return;
        }
        for part in self.parts.iter_mut().filter(|p| p.asked) {
            part.along(v, &self.half);
            for ((own, &i), scale) in part.y.iter_mut().zip(&part.rows).zip(&part.scale) {
                *own = y[i] / scale;
            }
            let (own_v, own_y) = (&part.v, &mut part.y);
            either!(&part.engine, own => own.refine_multipliers(own_v, own_y));
            part.give(y);
        }
        for range in &self.ranges {
            for (i, _) in [range.lower, range.upper].into_iter().flatten() {
                y[i] = 0.0;
            }
        }
        put_back(columns(program), &self.ranges, |j| d[j], y);
    }

    /// Σ|v_j| over the basic ξ.
    pub(super) fn basic_abs_sum(&mut self, v: &[f64]) -> f64 {
        if !self.apart {
            return self.whole.basic_abs_sum(v);
        }
        let mut sum = 0.0;
        for part in self.parts.iter_mut().filter(|p| p.asked) {
            part.along(v, &self.half);
            let own_v = &part.v;
            sum += either!(&part.engine, own => own.basic_abs_sum(own_v));
        }
        sum
    }

    /// dᵀξ at the present vertex.
    pub(super) fn objective(&self, d: &[f64]) -> f64 {
        if !self.apart {
            return self.whole.objective(d);
        }
        let middle = d.iter().zip(&self.middle).fold(0.0, |s, (d, m)| s + d * m);
        let single = self.single.iter();
        let ends = single.fold(middle, |s, &j| s + d[j].abs() * self.half[j]);
        let asked = self.parts.iter().filter(|p| p.asked);
        asked.fold(ends, |s, p| {
            let direction = &p.direction;
            s + either!(&p.engine, own => own.objective(direction))
        })
    }

    /// The present ξ, |ξ| ≤ 1.
    pub(super) fn point(&mut self, d: &[f64], xi: &mut List<f64>) {
        if !self.apart {
            self.whole.point(xi);
            return;
        }
        xi.clear();
        xi.extend(self.middle.iter().copied());
        for &j in &self.single {
            xi[j] += if d[j] < 0.0 {
                -self.half[j]
            } else {
                self.half[j]
            };
        }
        let mut own_xi = List::new();
        for part in &self.parts {
            either!(&part.engine, own => own.point(&mut own_xi));
            for (&j, x) in part.cols.iter().zip(&own_xi) {
                xi[j] += self.half[j] * x;
            }
        }
        xi.iter_mut().for_each(|x| *x = x.clamp(-1.0, 1.0));
    }

    /// The basic ξ moved by what r = b − Aξ leaves, |ξ| ≤ 1.
    pub(super) fn refine_point(&mut self, r: &[f64], xi: &mut [f64]) {
        if !self.apart {
            self.whole.refine_point(r, xi);
            return;
        }
        for part in &mut self.parts {
            for ((own, &i), scale) in part.y.iter_mut().zip(&part.rows).zip(&part.scale) {
                *own = r[i] * scale;
            }
            for (own, &j) in part.v.iter_mut().zip(&part.cols) {
                *own = (xi[j] - self.middle[j]) / self.half[j];
            }
            let (own_r, own_xi) = (&part.y, &mut part.v);
            either!(&part.engine, own => own.refine_point(own_r, own_xi));
            for (&own, &j) in part.v.iter().zip(&part.cols) {
                xi[j] = (self.middle[j] + self.half[j] * own).clamp(-1.0, 1.0);
            }
        }
    }
}

impl Part {
    /// Takes its share of the direction.
    fn aim(&mut self, d: &[f64], half: &[f64]) {
        let mut concerned = false;
        for (own, &j) in self.direction.iter_mut().zip(&self.cols) {
            *own = d[j] * half[j];
            concerned |= d[j] != 0.0;
        }
        self.asked = concerned || !self.known;
    }

    /// Its share of a vector along ξ.
    fn along(&mut self, v: &[f64], half: &[f64]) {
        for (own, &j) in self.v.iter_mut().zip(&self.cols) {
            *own = v[j] * half[j];
        }
    }

    /// Its multipliers as those of the program's rows.
    fn give(&self, y: &mut [f64]) {
        for ((&i, own), scale) in self.rows.iter().zip(&self.y).zip(&self.scale) {
            y[i] = own * scale;
        }
    }

    fn rebuild(&mut self) -> u64 {
        match &mut self.engine {
            Engine::Tableau(own) => own.rebuild(&self.program),
            Engine::Inverse(own) => own.rebuild(),
        }
    }
}

/// The columns of a program that is taken apart.
fn columns(program: &Program) -> &Lines {
    let entries = program.entries();
    &entries
        .expect("only programs with their entries listed are taken apart")
        .cols
}

/// Sets the multipliers of the rows that bound one column, 0 so far, from those of the others.
fn put_back(cols: &Lines, ranges: &[Range], d: impl Fn(usize) -> f64, y: &mut [f64]) {
    for range in ranges {
        let column = cols.line(range.column);
        let v = column.fold(d(range.column), |s, (k, a)| s - y[k] * a);
        let end = if v > 0.0 { range.upper } else { range.lower };
        if let Some((i, a)) = end
            && v != 0.0
        {
            y[i] = v / a;
        }
    }
}

/// The rows and the columns of a connected part.
type Block = (List<usize>, List<usize>);

/// What is left of a program while rows and columns leave.
struct Presolve<'a> {
    program: &'a Program,
    entries: &'a Compressed,
    /// b less what the ξ put in take of it.
    right: List<f64>,
    /// Coefficients of each row whose ξ are not put in.
    left: List<usize>,
    /// The row is a range, or nothing.
    gone: List<bool>,
    /// The lower and the upper end of each ξ.
    ends: List<(f64, f64)>,
    ranges: List<Option<Range>>,
    fixed: List<bool>,
    /// The ξ put in, in order.
    put: List<usize>,
}

impl<'a> Presolve<'a> {
    fn of(program: &'a Program, entries: &'a Compressed) -> Self {
        let (m, n) = (program.rows(), program.cols());
        Self {
            program,
            entries,
            right: program.right_side().iter().copied().collect(),
            left: (0..m).map(|i| entries.rows.count(i)).collect(),
            gone: List::filled(false, m),
            ends: List::filled((-1.0, 1.0), n),
            ranges: List::filled(None, n),
            fixed: List::filled(false, n),
            put: List::new(),
        }
    }

    /// Lets rows with one coefficient and ξ that are known leave until there are none; true if the rows are proved empty.
    fn reduce(&mut self) -> bool {
        let mut next: List<usize> = (0..self.left.len())
            .filter(|&i| self.left[i] <= 1)
            .collect();
        let mut at = 0;
        while at < next.len() {
            let i = next[at];
            at += 1;
            if self.gone[i] {
                continue;
            }
            let mut free = self.entries.rows.line(i).filter(|(j, _)| !self.fixed[*j]);
            let Some((j, a)) = free.next() else {
                self.gone[i] = true;
                if self.right[i].abs() > self.program.slack()[i]
                    && self.proves(&[(i, self.right[i].signum())])
                {
                    return true;
                }
                continue;
            };
            if a.abs() < DIVISOR {
                continue;
            }
            self.gone[i] = true;
            if self.bound(i, j, a) {
                return true;
            }
            let (lo, hi) = self.ends[j];
            if hi - lo <= POINT {
                self.fixed[j] = true;
                self.put.push(j);
                let x = 0.5 * (lo + hi);
                self.ends[j] = (x, x);
                for (k, a) in self.entries.cols.line(j) {
                    self.right[k] -= a * x;
                    self.left[k] -= 1;
                    if self.left[k] <= 1 && !self.gone[k] {
                        next.push(k);
                    }
                }
            }
        }
        false
    }

    /// Row `i`, with the one coefficient `a` of ξ_j, bounds it; true if that is a proof of emptiness.
    fn bound(&mut self, i: usize, j: usize, a: f64) -> bool {
        let (b, delta) = (self.right[i], self.program.slack()[i]);
        let middle = b / a;
        let width = delta / a.abs();
        let (lo, hi) = self.ends[j];
        let (mut new_lo, mut new_hi) = (lo, hi);
        let mut range = self.ranges[j].unwrap_or(Range {
            column: j,
            lower: None,
            upper: None,
        });
        if middle - width > lo {
            (new_lo, range.lower) = (middle - width, Some((i, a)));
        }
        if middle + width < hi {
            (new_hi, range.upper) = (middle + width, Some((i, a)));
        }
        let empty = new_lo > new_hi && {
            let lower = range.lower.map(|(i, a)| (i, 1.0 / a));
            let upper = range.upper.map(|(i, a)| (i, -1.0 / a));
            let rows: List<(usize, f64)> = [lower, upper].into_iter().flatten().collect();
            self.proves(&rows)
        };
        // Ends that cross by rounding alone are one point.
        self.ends[j] = if new_lo <= new_hi {
            (new_lo, new_hi)
        } else {
            let x = (0.5 * (new_lo + new_hi)).clamp(-1.0, 1.0);
            (x, x)
        };
        if range.lower.is_some() || range.upper.is_some() {
            self.ranges[j] = Some(range);
        }
        empty
    }

    /// Whether the multipliers given, with those of the ξ put in so far, prove that no ξ satisfies the rows.
    fn proves(&self, rows: &[(usize, f64)]) -> bool {
        let mut y = List::filled(0.0, self.program.rows());
        let mut v = List::filled(0.0, self.program.stride());
        // Put back for the maximum of 0, whose multipliers are those of the proof with the other sign.
        let put = self.put.iter().rev().filter_map(|&j| self.ranges[j]);
        let put: List<Range> = put.collect();
        let entries = &self.entries.cols;
        for &(i, x) in rows {
            y[i] = -x;
        }
        put_back(entries, &put, |_| 0.0, &mut y);
        y.iter_mut().for_each(|y| *y = -*y);
        self.program.farkas(&y, &mut v) > 0.0
    }

    /// The ranges in the order in which multipliers are put back.
    fn order(&self) -> List<Range> {
        let stayed = (0..self.fixed.len()).filter(|&j| !self.fixed[j]);
        let put = self.put.iter().rev().copied();
        stayed.chain(put).filter_map(|j| self.ranges[j]).collect()
    }

    /// The rows and columns of each connected part, by its first row, and the columns in none.
    fn blocks(&self) -> (Vec<Block>, List<usize>) {
        let n = self.fixed.len();
        let mut parent: List<usize> = (0..n).collect();
        fn root(parent: &mut [usize], mut j: usize) -> usize {
            while parent[j] != j {
                parent[j] = parent[parent[j]];
                j = parent[j];
            }
            j
        }
        let rows = || (0..self.gone.len()).filter(|&i| !self.gone[i]);
        let free = |i: usize| {
            let line = self.entries.rows.line(i).map(|(j, _)| j);
            line.filter(|&j| !self.fixed[j])
        };
        let mut within = List::filled(false, n);
        for i in rows() {
            let mut first = None;
            for j in free(i) {
                within[j] = true;
                let own = root(&mut parent, j);
                match first {
                    None => first = Some(own),
                    Some(other) if other != own => {
                        let (low, high) = (own.min(other), own.max(other));
                        parent[high] = low;
                        first = Some(low);
                    }
                    Some(_) => {}
                }
            }
        }
        let mut number = List::filled(usize::MAX, n);
        let mut blocks: Vec<Block> = Vec::new();
        for i in rows() {
            let Some(j) = free(i).next() else { continue };
            let at = root(&mut parent, j);
            if number[at] == usize::MAX {
                number[at] = blocks.len();
                blocks.push((List::new(), List::new()));
            }
            blocks[number[at]].0.push(i);
        }
        let mut single = List::new();
        for j in 0..n {
            if within[j] {
                let at = root(&mut parent, j);
                blocks[number[at]].1.push(j);
            } else if !self.fixed[j] {
                single.push(j);
            }
        }
        (blocks, single)
    }
}
