//! A dual simplex for boxed variables on an explicit inverse of the basis: for rows with few entries.
//!
//! The same programs, steps and long-step ratio test as `simplex`, but the tableau is not kept: of Aξ + s = b, |s_i| ≤ δ_i,
//! only B⁻¹ (m × m) is, and a row or a column of T = B⁻¹N is made when it is asked for, from the entries of A that
//! are not 0. A pivot costs what B⁻¹ has in the rows and columns that it touches and what A has in the rows
//! that B⁻¹'s row names; both stay far below m n where A is sparse and n a multiple of m.
//!
//! **Leaving.** Dual steepest edge: the basic variable of the largest excess²/‖row of B⁻¹‖². The norms are computed
//! anew in the pass that updates the rows, so they are exact up to rounding.
//!
//! **Entering.** Long steps as in `simplex`. Harris's second pass, which takes the largest pivot within a small gap and sets
//! the reduced costs overrun to 0, was tried and left out: what it sets to 0 stalls the steps that the perturbation
//! made move (300 pivots a program in place of 41 at 30 × 120 and a density of 0.1). A pivot that is weak beside one passed is
//! avoided as in `simplex`.
//!
//! **Perturbation.** With sparse rows most reduced costs are 0 and the dual step would not move. The objective is perturbed
//! before the first step if enough of them are: each moves away from 0 on its variable's side by [`PERTURBATION`]
//! of the largest coefficient times 1 to 2, by the variable's index. At the optimum the true objective comes back;
//! a reduced cost that is wrong by no more than [`NEAR`] stays so, and costs the bound twice that at most. What is more
//! wrong is mended by further steps.
//!
//! Nothing here has to be right for the bounds to be: see `certificate`.

use super::breakpoints::{Breakpoint, PIVOT, collect, crossing, step_limit};
use super::compressed::Compressed;
use super::simplex::{FREE_SLACK, Outcome, STALLED, STUCK, TIRED, WEAK};
use crate::{List, ops};

/// By how much a reduced cost is moved at least, as a share of the largest objective coefficient.
const PERTURBATION: f64 = 1e-13;

/// Perturbations of one objective at most.
const PERTURBATIONS: usize = 4;

/// A reduced cost below this share of the largest objective coefficient is taken for 0: its variable keeps its side.
const NEAR: f64 = 5e-13;

/// A pivot of the column that differs from that of the row by more than this part of it shows that B⁻¹ has drifted.
const DRIFT: f64 = 1e-7;

/// Where one nonbasic ξ in so many has a reduced cost of 0, the objective is perturbed before the first step.
const SHARE: usize = 16;

/// Sums run in so many lanes, and rows of B⁻¹ are padded to a multiple of it.
const LANES: usize = 8;

/// No row: the variable is not basic.
const NOWHERE: usize = usize::MAX;

/// B⁻¹ and the state of the variables. Variables 0..n are ξ, n.. are the slacks.
#[derive(Clone, Debug, Default)]
pub(super) struct Revised {
    rows: usize,
    cols: usize,
    stride: usize,
    a: Compressed,
    b: List<f64>,
    inverse: List<f64>,
    /// ‖row i of B⁻¹‖².
    norm: List<f64>,
    x: List<f64>,
    basis: List<usize>,
    basic_range: List<f64>,
    /// The row in which a variable is basic, or [`NOWHERE`].
    place: List<usize>,
    reduced: List<f64>,
    /// Where a nonbasic variable stands; 0 for basic ones and slacks without a range.
    side: List<f64>,
    range: List<f64>,
    aside: List<usize>,
    /// Row r of T, one a variable.
    row: List<f64>,
    /// Column q of T.
    column: List<f64>,
    /// Row r of B⁻¹ and the positions where it is not 0.
    inverse_row: List<f64>,
    touched: List<usize>,
    /// A vector of right sides, zero between uses.
    right: List<f64>,
    multipliers: List<f64>,
    /// side·reduced and ±side·row of the variables that may enter.
    gap: List<f64>,
    slope: List<f64>,
    /// How many variables may enter: the slacks come last, and often none has a range.
    open: usize,
    breakpoints: List<Breakpoint>,
    flips: List<(usize, f64)>,
    age: u64,
    size: f64,
    perturbations: usize,
    perturbed: bool,
}

impl Revised {
    /// The slack basis of |Aξ − b| ≤ δ.
    pub(super) fn start(&mut self, a: Compressed, b: &[f64], delta: &[f64]) {
        let (m, n) = (a.rows.len(), a.cols.len());
        (self.rows, self.cols) = (m, n);
        self.stride = m.next_multiple_of(LANES).max(LANES);
        self.a = a;
        self.b = b.iter().copied().collect();
        self.range.clear();
        self.range.resize(n, 1.0);
        let free = |&d: &f64| if d > FREE_SLACK { d } else { 0.0 };
        self.range.extend(delta.iter().map(free));
        self.side = self.range.iter().map(|r| f64::from(*r > 0.0)).collect();
        for (v, length) in [
            (&mut self.reduced, n + m),
            (&mut self.row, n + m),
            (&mut self.gap, n + m),
            (&mut self.slope, n + m),
            (&mut self.x, m),
            (&mut self.norm, m),
            (&mut self.basic_range, m),
            (&mut self.column, m),
            (&mut self.inverse_row, self.stride),
            (&mut self.right, self.stride),
            (&mut self.multipliers, m),
            (&mut self.inverse, m * self.stride),
        ] {
            v.clear();
            v.resize(length, 0.0);
        }
        self.open = (0..n + m)
            .rev()
            .find(|&v| self.range[v] > 0.0)
            .map_or(0, |v| v + 1);
        self.breakpoints.clear();
        self.breakpoints.resize(n + m, Breakpoint::default());
        self.basis.clear();
        self.basis.resize(m, 0);
        self.place.clear();
        self.place.resize(n + m, NOWHERE);
        self.slacks();
    }

    /// All slacks basic.
    fn slacks(&mut self) {
        self.place.fill(NOWHERE);
        self.inverse.fill(0.0);
        self.norm.fill(1.0);
        for i in 0..self.rows {
            let slack = self.cols + i;
            self.inverse[i * self.stride + i] = 1.0;
            self.basis[i] = slack;
            self.place[slack] = i;
            self.basic_range[i] = self.range[slack];
            self.side[slack] = 0.0;
        }
        self.aside.clear();
        self.age = 0;
    }

    /// Makes B⁻¹ of the present basis from the entries of A; returns the pivots that took. Where the basis has become
    /// singular, slacks stay in it.
    ///
    /// Columns with few entries first, and of the rows with a pivot a tenth as large as the largest that with fewest
    /// entries, so that B⁻¹ fills late.
    pub(super) fn rebuild(&mut self) -> u64 {
        let n = self.cols;
        let mut wanted: List<usize> = self.basis.iter().copied().filter(|&v| v < n).collect();
        wanted.sort_unstable_by_key(|&v| (self.a.cols.count(v), v));
        let keep: List<usize> = self.basis.iter().copied().filter(|&v| v >= n).collect();
        self.slacks();
        let mut leaves = List::filled(true, self.rows);
        for v in keep {
            leaves[v - n] = false;
        }
        let mut pivots = 0;
        for v in wanted {
            self.make_column(v);
            let largest = (0..self.rows)
                .filter(|&i| leaves[i])
                .fold(0.0, |m: f64, i| m.max(self.column[i].abs()));
            if largest > PIVOT {
                let rows =
                    (0..self.rows).filter(|&i| leaves[i] && self.column[i].abs() >= 0.1 * largest);
                let r = rows.min_by_key(|&i| (self.a.rows.count(i), i));
                let r = r.expect("the row of the largest entry is among them");
                leaves[r] = false;
                self.take_inverse_row(r);
                self.update_inverse(r);
                ops::pivot(0);
                let out = self.basis[r];
                self.place[out] = NOWHERE;
                self.side[out] = f64::from(self.range[out] > 0.0);
                self.enter(v, r);
                pivots += 1;
            } else if self.side[v] == 0.0 {
                self.side[v] = 1.0;
            }
        }
        self.age = 0;
        pivots
    }

    fn enter(&mut self, v: usize, r: usize) {
        self.basis[r] = v;
        self.place[v] = r;
        self.basic_range[r] = self.range[v];
        self.side[v] = 0.0;
    }

    /// True if enough pivots were made since B⁻¹ was made for rounding to matter.
    pub(super) fn tired(&self) -> bool {
        self.age > TIRED
    }

    /// True if making B⁻¹ again would change anything.
    pub(super) fn aged(&self) -> bool {
        self.age > 0
    }

    /// Takes the objective `d`: reduced costs, sides and basic values of the present basis.
    pub(super) fn aim(&mut self, d: &[f64]) {
        self.size = d.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        self.perturbations = 0;
        self.price(d);
        for &i in &self.aside {
            self.basic_range[i] = self.range[self.basis[i]];
        }
        self.aside.clear();
        let near = NEAR * self.size;
        let free = |v: &usize| self.place[*v] == NOWHERE && self.a.cols.count(*v) > 0;
        let flat = (0..self.cols)
            .filter(free)
            .filter(|&v| self.reduced[v].abs() <= near)
            .count();
        if flat * SHARE > self.cols {
            self.perturb();
        }
        self.recompute_values();
    }

    /// The reduced costs of `d` in the present basis, each variable on the side that they ask for.
    fn price(&mut self, d: &[f64]) {
        let (n, m) = (self.cols, self.rows);
        self.perturbed = false;
        self.multipliers.fill(0.0);
        for (i, &v) in self.basis.iter().enumerate() {
            let cost = if v < n { d[v] } else { 0.0 };
            if cost != 0.0 {
                ops::count(m, m);
                let row = &self.inverse[i * self.stride..][..m];
                for (y, &t) in self.multipliers.iter_mut().zip(row) {
                    *y += cost * t;
                }
            }
        }
        self.reduced[..n].copy_from_slice(&d[..n]);
        for (k, &y) in self.multipliers.iter().enumerate() {
            self.reduced[n + k] = -y;
            if y != 0.0 {
                ops::count(self.a.rows.count(k), self.a.rows.count(k));
                for (j, a) in self.a.rows.line(k) {
                    self.reduced[j] -= y * a;
                }
            }
        }
        for &v in &self.basis {
            self.reduced[v] = 0.0;
        }
        let near = NEAR * self.size;
        for (side, &r) in self.side.iter_mut().zip(&self.reduced) {
            // A variable that is basic or without a range has no side.
            if *side != 0.0 && r.abs() > near {
                *side = if r > 0.0 { 1.0 } else { -1.0 };
            }
        }
    }

    /// Moves every reduced cost away from 0 on its variable's side.
    fn perturb(&mut self) {
        // Of no objective any will do: it is a point that is sought.
        let size = if self.size > 0.0 { self.size } else { 1.0 };
        let least = PERTURBATION * size;
        for (v, (reduced, &side)) in self.reduced.iter_mut().zip(&self.side).enumerate() {
            // Multiples of the golden ratio, modulo 1: no two are alike.
            let spread = f64::from((v as u32).wrapping_mul(0x9E37_79B9)) / 4_294_967_296.0;
            *reduced += side * least * (1.0 + spread);
        }
        self.perturbations += 1;
        self.perturbed = true;
    }

    /// x_B = B⁻¹(b − N x_N).
    fn recompute_values(&mut self) {
        let n = self.cols;
        self.right[..self.rows].copy_from_slice(&self.b);
        for v in 0..n + self.rows {
            let value = self.side[v] * self.range[v];
            if value != 0.0 {
                self.add_to_right(v, -value);
            }
        }
        ops::count(
            self.rows * self.stride + self.a.rows.entries(),
            self.rows * self.stride + self.a.rows.entries(),
        );
        for (x, row) in self
            .x
            .iter_mut()
            .zip(self.inverse.chunks_exact(self.stride))
        {
            *x = dot(row, &self.right);
        }
        self.right.fill(0.0);
    }

    /// right += by · column of variable `v`.
    fn add_to_right(&mut self, v: usize, by: f64) {
        if v < self.cols {
            for (k, a) in self.a.cols.line(v) {
                self.right[k] += by * a;
            }
        } else {
            self.right[v - self.cols] += by;
        }
    }

    /// Pivots until the basis is optimal for `d` with `tolerance`, a row turns out infeasible, or the cap; returns
    /// the pivots.
    pub(super) fn run(&mut self, d: &[f64], tolerance: f64) -> (Outcome, u64) {
        let cap = 100 + 20 * (self.rows + self.cols);
        let (mut still, mut pivots) = (0, 0);
        let mut renewed = 0;
        while pivots < cap {
            if still > STALLED && !self.perturbed && self.perturbations < PERTURBATIONS {
                self.perturb();
                still = 0;
            }
            let by_index = still > STUCK;
            let Some(r) = self.leaving(by_index, tolerance) else {
                if !self.perturbed {
                    return (Outcome::Optimal, pivots as u64);
                }
                self.price(d);
                self.recompute_values();
                still = 0;
                continue;
            };
            self.take_inverse_row(r);
            self.make_row();
            let Some((q, step)) = self.entering(r, by_index, tolerance) else {
                return (Outcome::Infeasible { row: r }, pivots as u64);
            };
            self.make_column(q);
            let (own, other) = (self.column[r], self.row[q]);
            if (own - other).abs() > DRIFT * own.abs() && self.age > 0 && renewed < 3 {
                renewed += 1;
                pivots += self.rebuild() as usize;
                self.price(d);
                self.recompute_values();
                continue;
            }
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
        (Outcome::Capped, pivots as u64)
    }

    /// The basic variable that leaves.
    fn leaving(&self, by_index: bool, tolerance: f64) -> Option<usize> {
        if by_index {
            let pairs = self.x.iter().zip(&self.basic_range).enumerate();
            let over = pairs.filter(|(_, (x, range))| x.abs() - **range > tolerance);
            return over.map(|(i, _)| i).min_by_key(|&i| self.basis[i]);
        }
        let (mut best, mut most) = (None, 0.0);
        for (i, (x, range)) in self.x.iter().zip(&self.basic_range).enumerate() {
            let excess = x.abs() - range;
            if excess > tolerance && excess * excess > most * self.norm[i] {
                most = excess * excess / self.norm[i];
                best = Some(i);
            }
        }
        best
    }

    /// Row `r` of B⁻¹ and where it is not 0.
    fn take_inverse_row(&mut self, r: usize) {
        self.inverse_row
            .copy_from_slice(&self.inverse[r * self.stride..][..self.stride]);
        self.touched.clear();
        for (k, &x) in self.inverse_row.iter().enumerate() {
            if x != 0.0 {
                self.touched.push(k);
            }
        }
    }

    /// The row of T of that row of B⁻¹.
    fn make_row(&mut self) {
        let n = self.cols;
        let (of_columns, of_slacks) = self.row.split_at_mut(n);
        of_columns.fill(0.0);
        of_slacks.copy_from_slice(&self.inverse_row[..self.rows]);
        for &k in &self.touched {
            let by = self.inverse_row[k];
            ops::count(self.a.rows.count(k), self.a.rows.count(k));
            for (j, a) in self.a.rows.line(k) {
                of_columns[j] += by * a;
            }
        }
    }

    /// The column of T of variable `v`.
    fn make_column(&mut self, v: usize) {
        let rows = self.inverse.chunks_exact(self.stride);
        if v >= self.cols {
            let k = v - self.cols;
            for (t, row) in self.column.iter_mut().zip(rows) {
                *t = row[k];
            }
            return;
        }
        let entries = self.a.cols.count(v);
        ops::count(self.rows * entries, self.rows * entries);
        for (t, row) in self.column.iter_mut().zip(rows) {
            *t = self.a.cols.line(v).fold(0.0, |s, (k, a)| s + row[k] * a);
        }
    }

    /// The variable that enters for row `r`, the dual step, and in `flips` the variables passed.
    fn entering(&mut self, r: usize, by_index: bool, tolerance: f64) -> Option<(usize, f64)> {
        self.flips.clear();
        let open = self.open;
        let sign = if self.x[r] > 0.0 { -1.0 } else { 1.0 };
        let excess = self.x[r].abs() - self.basic_range[r];
        ops::count(3 * open, 0);
        let (slope, gap) = (&mut self.slope[..open], &mut self.gap[..open]);
        for ((((a, g), &t), &side), &d) in slope
            .iter_mut()
            .zip(gap.iter_mut())
            .zip(&self.row)
            .zip(&self.side)
            .zip(&self.reduced)
        {
            *a = sign * side * t;
            *g = side * d;
        }
        let (slope, gap, range) = (&*slope, &*gap, &self.range[..open]);
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
            let entering = points
                .iter()
                .filter(|b| b.step <= first)
                .min_by_key(|b| b.column);
            return entering.map(|b| (b.column, b.step));
        }
        let at = crossing(points, excess);
        let slope = |b: &Breakpoint| slope[b.column];
        let (passed, ahead) = points.split_at(at);
        let mut chosen = ahead[0];
        // Where the pivot is weak beside one already passed, stop at that earlier step instead.
        let strongest = passed.iter().fold(slope(&chosen), |m, b| m.max(slope(b)));
        let early = slope(&chosen) < WEAK * strongest;
        if early {
            let strong = |b: &&Breakpoint| slope(b) >= WEAK * strongest;
            let mut last = None;
            for b in passed.iter().filter(strong) {
                if last.is_none_or(|l: Breakpoint| b.step > l.step) {
                    last = Some(*b);
                }
            }
            chosen = last.unwrap_or(chosen);
        }
        let flipped = passed.iter().filter(|b| !early || b.step < chosen.step);
        for b in flipped {
            let by = 2.0 * self.side[b.column] * self.range[b.column];
            self.flips.push((b.column, by));
        }
        Some((chosen.column, chosen.step))
    }

    /// Moves the variables passed to their other side and the basic values along.
    fn flip(&mut self) {
        if self.flips.is_empty() {
            return;
        }
        let flips = std::mem::take(&mut self.flips);
        for &(v, by) in &flips {
            self.side[v] = -self.side[v];
            self.add_to_right(v, by);
        }
        self.flips = flips;
        let entries = self.right.iter().filter(|x| **x != 0.0).count();
        let rows = self.inverse.chunks_exact(self.stride);
        if 4 * entries < self.rows {
            ops::count(self.rows * entries, self.rows * entries);
            let right = &self.right;
            let named = || (0..right.len()).filter(|&k| right[k] != 0.0);
            let named: List<usize> = named().collect();
            for (x, row) in self.x.iter_mut().zip(rows) {
                *x += named.iter().fold(0.0, |s, &k| s + row[k] * right[k]);
            }
        } else {
            ops::count(self.rows * self.stride, self.rows * self.stride);
            for (x, row) in self.x.iter_mut().zip(rows) {
                *x += dot(row, &self.right);
            }
        }
        self.right.fill(0.0);
    }

    /// Exchanges the basic variable of row `r`, which goes to `bound`·its range, with variable `q`, whose column and row
    /// are made.
    fn exchange(&mut self, r: usize, q: usize, bound: f64) {
        let pivot = self.column[r];
        let old = self.side[q] * self.range[q];
        let move_by = (self.x[r] - bound * self.basic_range[r]) / pivot;
        for (x, &c) in self.x.iter_mut().zip(&self.column) {
            *x -= c * move_by;
        }
        self.x[r] = old + move_by;
        let cost = self.reduced[q] / pivot;
        ops::count(self.row.len() + self.rows, self.row.len() + self.rows);
        for (d, &t) in self.reduced.iter_mut().zip(&self.row) {
            *d -= cost * t;
        }
        let out = self.basis[r];
        self.reduced[out] = -cost;
        self.reduced[q] = 0.0;
        self.place[out] = NOWHERE;
        self.side[out] = if self.range[out] > 0.0 { bound } else { 0.0 };
        self.enter(q, r);
        self.update_inverse(r);
        self.age += 1;
    }

    /// B⁻¹ after the exchange in row `r` with the column and the row of B⁻¹ that are made, and its rows' norms.
    fn update_inverse(&mut self, r: usize) {
        let pivot = self.column[r];
        let stride = self.stride;
        let by = 1.0 / pivot;
        for &k in &self.touched {
            self.inverse_row[k] *= by;
        }
        let new = &self.inverse_row[..stride];
        let few = 4 * self.touched.len() < self.rows;
        let rows = self.inverse.chunks_exact_mut(stride);
        let (mut dense, mut sparse) = (0, 0);
        for (i, ((row, &c), norm)) in rows.zip(&self.column).zip(&mut self.norm).enumerate() {
            if i == r {
                row.copy_from_slice(new);
                *norm = dot(new, new);
            } else if c != 0.0 && few {
                sparse += 1;
                let mut change = 0.0;
                for &k in &self.touched {
                    let old = row[k];
                    row[k] = old - c * new[k];
                    change += row[k] * row[k] - old * old;
                }
                // Far above what cancels, whatever rounding did: the norm only ranks.
                *norm = (*norm + change).max(1e-12);
            } else if c != 0.0 {
                dense += 1;
                *norm = subtract(row, new, c);
            }
        }
        ops::count_of(|| {
            let touched = 2 * sparse * self.touched.len();
            (
                2 * dense * stride + touched + stride,
                2 * dense * stride + touched,
            )
        });
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

    /// y, one a row: minus the reduced costs of the slacks.
    pub(super) fn multipliers(&self, y: &mut [f64]) {
        for (k, y) in y.iter_mut().enumerate() {
            let slack = self.cols + k;
            *y = if self.place[slack] == NOWHERE {
                -self.reduced[slack]
            } else {
                0.0
            };
        }
    }

    /// y += B⁻ᵀ v_B, for v = d − Aᵀy.
    pub(super) fn refine_multipliers(&self, v: &[f64], y: &mut [f64]) {
        let rows = self.inverse.chunks_exact(self.stride);
        let before: List<f64> = y.iter().copied().collect();
        for (&b, row) in self.basis.iter().zip(rows) {
            let defect = if b < self.cols {
                v[b]
            } else {
                -before[b - self.cols]
            };
            if defect != 0.0 {
                for (y, &t) in y.iter_mut().zip(row) {
                    *y += defect * t;
                }
            }
        }
    }

    /// Row `row` of B⁻¹, with the sign of the Farkas inequality bᵀy > ‖Aᵀy‖₁ + |y|ᵀδ.
    pub(super) fn farkas(&self, row: usize, y: &mut [f64]) {
        let sign = if self.x[row] > 0.0 { 1.0 } else { -1.0 };
        let own = &self.inverse[row * self.stride..][..self.rows];
        for (y, &t) in y.iter_mut().zip(own) {
            *y = sign * t;
        }
    }

    /// Σ|v_j| over the basic ξ.
    pub(super) fn basic_abs_sum(&self, v: &[f64]) -> f64 {
        let basic = self.basis.iter().filter(|&&b| b < self.cols);
        basic.fold(0.0, |s, &b| s + v[b].abs())
    }

    /// The present ξ, clamped to |ξ| ≤ 1.
    pub(super) fn point(&self, xi: &mut List<f64>) {
        xi.clear();
        let standing = self.side[..self.cols].iter().zip(&self.place);
        xi.extend(standing.map(|(&side, &at)| match at {
            NOWHERE => side,
            _ => self.x[at].clamp(-1.0, 1.0),
        }));
    }

    /// dᵀξ at the present vertex.
    pub(super) fn objective(&self, d: &[f64]) -> f64 {
        let standing = self.side[..self.cols].iter().zip(&self.place).zip(d);
        standing.fold(0.0, |s, ((&side, &at), d)| {
            s + d * if at == NOWHERE { side } else { self.x[at] }
        })
    }

    /// ξ_B += B⁻¹ r for r = b − Aξ, clamped.
    pub(super) fn refine_point(&self, r: &[f64], xi: &mut [f64]) {
        let rows = self.inverse.chunks_exact(self.stride);
        for (&b, row) in self.basis.iter().zip(rows) {
            if b < self.cols {
                let change = row.iter().zip(r).fold(0.0, |s, (t, r)| s + t * r);
                xi[b] = (xi[b] + change).clamp(-1.0, 1.0);
            }
        }
    }
}

/// row −= by · new, and the sum of the squares of what is left.
fn subtract(row: &mut [f64], new: &[f64], by: f64) -> f64 {
    let mut lanes = [0.0; LANES];
    for (row, new) in row.chunks_exact_mut(LANES).zip(new.chunks_exact(LANES)) {
        for l in 0..LANES {
            row[l] -= by * new[l];
            lanes[l] += row[l] * row[l];
        }
    }
    together(&lanes)
}

/// Σ a_i b_i, for lengths that are multiples of [`LANES`].
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for l in 0..LANES {
            lanes[l] += a[l] * b[l];
        }
    }
    together(&lanes)
}

fn together(lanes: &[f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}
