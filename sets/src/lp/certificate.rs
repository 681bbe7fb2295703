//! Bounds that hold for any multipliers, and points that are checked.
//!
//! Weak duality over a box: for every ξ with |ξ| ≤ 1 and |Aξ − b| ≤ δ, and for **any** y,
//!
//! dᵀξ = yᵀAξ + (d − Aᵀy)ᵀξ ≤ bᵀy + |y|ᵀδ + ‖d − Aᵀy‖₁ =: core(d, y).
//!
//! **Rounding of core.** Let m, n be the numbers of rows and columns and
//! S = ‖d‖₁ + Σ|y_i|(|A_i|1 + |b_i| + δ_i). Each summand d_j, y_iA_ij, y_ib_i, |y_i|δ_i passes through at
//! most 1 rounding of its product, m of the sum d_j − Σ_i y_iA_ij, n − 1 of the sum over j, and 3 that join
//! the parts: at most K = m + n + 3 (the sums over i of the other two parts are shorter). So the computed
//! core is off by at most γ_K·S, γ_K = Ku/(1 − Ku). S itself is computed with nonnegative summands, the row
//! weights |A_i|1 + |b_i| + δ_i being upper bounds, in at most m + n + 1 roundings, so it is at least
//! (1 − γ_K)·S. The charge is
//!
//! e = (K + 5)·1.2e-16·S_computed,
//!
//! and 1.2e-16 ≥ 1.08u covers 1/((1 − Ku)(1 − γ_K)) as long as K ≤ 2⁴⁰; the 5u·S in excess cover a product
//! that underflows (each loses at most 2⁻¹⁰⁷⁵, fewer than 2⁵² of them lose at most η/2) unless
//! S < 2⁻⁹⁶⁹, and there the final + η does. U = next_up(core + e) + η; next_up pays for that sum. An
//! infinity or NaN anywhere makes the bound +∞, and ⌈‖d‖₁⌉ (the bound of y = 0) caps it.
//!
//! That last step in full. For S ≥ 2⁻⁹⁶⁹ the excess 5·1.08·u·S_computed ≥ 5u·S is at least 5·2⁻¹⁰²² > η/2. For
//! S < 2⁻⁹⁶⁹ the computed core + e is below 2⁻⁹⁶⁸, so next_up, of which the rounding of that sum takes half a unit,
//! leaves half a unit; if the sum is below 2⁻⁹⁶⁹, η is a multiple of the unit of the result or finer and arrives in
//! full, and if it is not, the unit is 2⁻¹⁰²¹ and its half is η. S and e themselves lose less than 2⁻¹⁰⁷⁴ to
//! underflow then, which η/2 pays beside the products' η/2.
//!
//! **Few entries.** Where most entries of A are 0 the sums run along the others: what is left out are products with an entry
//! or a multiplier that is exactly 0, which add nothing and round nothing, so every term passes through no more
//! roundings than above. A y_i that is infinite or NaN makes core + e so by Σ|y_i|(|A_i|1 + |b_i| + δ_i), whose factors are
//! positive as computed.
//!
//! **Emptiness.** With d = 0 a feasible ξ gives 0 ≤ bᵀz + |z|ᵀδ + ‖Aᵀz‖₁ for every z; so if
//! U(0, −y) < 0 there is none.
//!
//! **Scaling.** Rows, and a direction, are multiplied by powers of two that bring their largest coefficient into [1, 2).
//! It is exact, because a row is only scaled if scaling back returns every entry; so the scaled rows
//! describe the same set, and everything here is about them.

use super::compressed::Compressed;
use crate::matrix::abs_sum;
use crate::rounding::{ETA, gamma, up};
use crate::{List, Matrix, SetError, ops};

/// The rows |Aξ − b| ≤ δ, equilibrated.
#[derive(Clone, Debug, Default)]
pub(super) struct Program {
    rows: usize,
    cols: usize,
    /// Row length in `a`, a multiple of [`LANES`]; the excess is zero.
    stride: usize,
    a: List<f64>,
    b: List<f64>,
    delta: List<f64>,
    /// Upper bounds on |A_i|1 + |b_i| + δ_i.
    weight: List<f64>,
    /// The power of two that row i was multiplied by.
    scale: List<f64>,
    /// The entries that are not 0, of a program that is large and has few.
    entries: Compressed,
    listed: bool,
}

/// Programs with fewer coefficients, zeros among them, are small.
const LARGE: usize = 3000;

/// Programs in which more than one coefficient in so many is not 0 have many.
const FEW: usize = 2;

/// Rows are padded to a multiple of this.
pub(super) const LANES: usize = 4;

impl Program {
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn cols(&self) -> usize {
        self.cols
    }

    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.a
    }

    pub(super) fn right_side(&self) -> &[f64] {
        &self.b
    }

    pub(super) fn slack(&self) -> &[f64] {
        &self.delta
    }

    /// The power of two that each row was multiplied by.
    pub(super) fn scales(&self) -> &[f64] {
        &self.scale
    }

    /// The entries that are not 0, where [`Program::list`] found the program large and them few.
    pub(super) fn entries(&self) -> Option<&Compressed> {
        self.listed.then_some(&self.entries)
    }

    /// Lists the entries that are not 0, if the program is large and they are few.
    pub(super) fn list(&mut self) {
        let all = self.rows * self.cols;
        self.listed = all >= LARGE && FEW * self.a.iter().filter(|x| **x != 0.0).count() <= all;
        if self.listed {
            let (a, stride, cols) = (&self.a, self.stride, self.cols);
            self.entries.fill(self.rows, cols, |i| {
                let row = a[i * stride..][..cols].iter().copied().enumerate();
                row.filter(|(_, x)| *x != 0.0)
            });
        }
    }

    pub(super) fn load(&mut self, a: &Matrix, b: &[f64], delta: &[f64]) -> Result<(), SetError> {
        const OP: &str = "linear program";
        let (rows, cols) = (a.rows(), a.cols());
        for got in [b.len(), delta.len()] {
            if got != rows {
                return Err(SetError::Dimension {
                    op: OP,
                    expected: rows,
                    got,
                });
            }
        }
        if let Some(&value) = a
            .as_slice()
            .iter()
            .chain(b)
            .chain(delta)
            .find(|x| !x.is_finite())
        {
            return Err(SetError::NotFinite { op: OP, value });
        }
        if let Some(&got) = delta.iter().find(|&&x| x < 0.0) {
            return Err(SetError::Range {
                op: OP,
                what: "constraint slack",
                expected: "at least 0",
                got,
            });
        }
        self.listed = false;
        (self.rows, self.cols, self.stride) = (rows, cols, cols.next_multiple_of(LANES).max(LANES));
        self.a.clear();
        self.a.resize(rows * self.stride, 0.0);
        self.b.clear();
        self.delta.clear();
        self.weight.clear();
        self.scale.clear();
        for i in 0..rows {
            let row = a.row(i);
            let scale = row_scale(row, b[i], delta[i]);
            let target = &mut self.a[i * self.stride..][..cols];
            for (t, &x) in target.iter_mut().zip(row) {
                *t = x * scale;
            }
            let (b, delta) = (b[i] * scale, delta[i] * scale);
            self.weight
                .push(up(abs_sum(target) + b.abs() + delta, cols + 2));
            self.b.push(b);
            self.delta.push(delta);
            self.scale.push(scale);
        }
        Ok(())
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.a[i * self.stride..][..self.stride]
    }

    /// Products of a sum over all of A.
    fn summed(&self) -> usize {
        match self.listed {
            true => self.entries.rows.entries(),
            false => self.rows * self.stride,
        }
    }

    /// U(d, y): at least max dᵀξ over the rows. Leaves d − Aᵀy in `v`. d and v are padded to the stride.
    pub(super) fn upper_bound(&self, d: &[f64], y: &[f64], v: &mut [f64]) -> f64 {
        let entries = self.summed();
        ops::count(
            entries + 3 * self.rows + 1,
            entries + 3 * self.rows + 2 * self.stride,
        );
        let size = abs_sum(d);
        let cap = up(size, self.cols);
        v.copy_from_slice(d);
        let (mut core, mut slack, mut weight) = (0.0, 0.0, size);
        if self.listed {
            for (i, &y) in y.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                for (j, a) in self.entries.rows.line(i) {
                    v[j] -= y * a;
                }
            }
        }
        // Four rows at a time: v is read and written once for all four.
        let mut i = if self.listed { self.rows } else { 0 };
        while i + 4 <= self.rows {
            let rows = &self.a[i * self.stride..][..4 * self.stride];
            let (r0, rest) = rows.split_at(self.stride);
            let (r1, rest) = rest.split_at(self.stride);
            let (r2, r3) = rest.split_at(self.stride);
            let [y0, y1, y2, y3] = [y[i], y[i + 1], y[i + 2], y[i + 3]];
            for ((((v, a0), a1), a2), a3) in v.iter_mut().zip(r0).zip(r1).zip(r2).zip(r3) {
                *v = *v - y0 * a0 - y1 * a1 - y2 * a2 - y3 * a3;
            }
            i += 4;
        }
        for i in i..self.rows {
            let y = y[i];
            for (v, &a) in v.iter_mut().zip(self.row(i)) {
                *v -= y * a;
            }
        }
        for (i, &y) in y.iter().enumerate() {
            core += y * self.b[i];
            slack += y.abs() * self.delta[i];
            weight += y.abs() * self.weight[i];
        }
        let core = core + slack + abs_sum(v);
        let charge = (self.rows + self.cols + 8) as f64 * 1.2e-16 * weight;
        let bound = (core + charge).next_up() + ETA;
        // A NaN is not below the cap.
        if bound < cap { bound } else { cap }
    }

    /// A lower bound on bᵀy − ‖Aᵀy‖₁ − |y|ᵀδ, rounding charged: if positive, no ξ satisfies the rows.
    pub(super) fn farkas(&self, y: &[f64], v: &mut [f64]) -> f64 {
        // U(0, −y) without its cap, by the same sums with opposite signs.
        let entries = self.summed();
        ops::count(
            entries + 3 * self.rows + 1,
            entries + 3 * self.rows + self.stride,
        );
        v.fill(0.0);
        let (mut core, mut weight) = (0.0, 0.0);
        for (i, &y) in y.iter().enumerate() {
            if self.listed {
                for (j, a) in self.entries.rows.line(i).filter(|_| y != 0.0) {
                    v[j] += y * a;
                }
            } else {
                for (v, &a) in v.iter_mut().zip(self.row(i)) {
                    *v += y * a;
                }
            }
            core += y * self.b[i];
            core -= y.abs() * self.delta[i];
            weight += y.abs() * self.weight[i];
        }
        let core = core - abs_sum(v);
        // `core` is summed in one chain of 2m + 1 here, hence 2m.
        let charge = (2 * self.rows + self.cols + 8) as f64 * 1.2e-16 * weight;
        let bound = (core - charge).next_down() - ETA;
        if bound.is_finite() {
            bound
        } else {
            f64::NEG_INFINITY
        }
    }

    /// The greatest excess of |Aξ − b| + reserve, rounding included, over δ + σ: at most 0 if ξ is
    /// verified. Leaves b − Aξ in `residual`. |ξ| ≤ 1 is the caller's; no reserve is zero.
    ///
    /// σ_i = 2γ_{n+2}(|A_i|1 + |b_i|) + 2η. The computed residual is off by at most γ_{n+1}(|A_i|1 + |b_i|).
    pub(super) fn missing(&self, xi: &[f64], reserve: &[f64], residual: &mut List<f64>) -> f64 {
        let entries = match self.listed {
            true => self.entries.rows.entries(),
            false => self.rows * self.cols,
        };
        ops::count(entries + 4 * self.rows, 2 * entries);
        residual.clear();
        residual.resize(self.rows, 0.0);
        let (error, sigma) = (gamma(self.cols + 1), 2.0 * gamma(self.cols + 2));
        let mut worst: f64 = f64::NEG_INFINITY;
        for (i, residual) in residual.iter_mut().enumerate() {
            let row = &self.row(i)[..self.cols];
            let (value, coefficients) = if self.listed {
                let line = self.entries.rows.line(i);
                line.fold((self.b[i], 0.0), |(s, t), (j, a)| {
                    (s - a * xi[j], t + a.abs())
                })
            } else {
                let terms = row.iter().zip(xi);
                (terms.fold(self.b[i], |s, (&a, &x)| s - a * x), abs_sum(row))
            };
            *residual = value;
            let size = coefficients + self.b[i].abs();
            let kept = reserve.get(i).map_or(0.0, |r| r * self.scale[i]);
            // The distance to δ is rounded by a part of itself: a point at the end of a wide slack is as good as any.
            let over = value.abs() - self.delta[i];
            let (above, below) = if over > 0.0 {
                (over, 0.0)
            } else {
                (0.0, -over)
            };
            let miss = up(above + error * size + kept, self.cols + 5);
            let allowed = (below + sigma * size) * (1.0 - gamma(self.cols + 5)) + 2.0 * ETA;
            let excess = miss - allowed;
            // A size that overflows allows nothing.
            worst = if excess.is_nan() || allowed == f64::INFINITY {
                f64::INFINITY
            } else {
                worst.max(excess)
            };
        }
        worst
    }

    /// Multipliers of the rows given, for the scaled rows.
    pub(super) fn scaled(&self, y: &[f64], scaled: &mut [f64]) {
        for ((s, y), scale) in scaled.iter_mut().zip(y).zip(&self.scale) {
            *s = y / scale;
        }
    }

    /// Multipliers of the scaled rows, in the units of the rows given.
    pub(super) fn unscaled(&self, y: &[f64]) -> Vec<f64> {
        y.iter().zip(&self.scale).map(|(y, s)| y * s).collect()
    }
}

/// The power of two, between 2⁻¹⁰⁰⁰ and 2¹⁰⁰⁰, that brings the largest |a_j| into [1, 2) or nearest to it, or 1 where
/// that would not be exact.
pub(super) fn row_scale(row: &[f64], b: f64, delta: f64) -> f64 {
    let largest = row.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if !largest.is_normal() {
        return 1.0;
    }
    // 2^±1000 leaves the sums of what is beyond it finite, and is a normal number with a normal inverse.
    let exponent = ((largest.to_bits() >> 52) as i64 - 1023).clamp(-1000, 1000);
    let power = |e: i64| f64::from_bits(((1023 + e) as u64) << 52);
    let (scale, back) = (power(-exponent), power(exponent));
    let exact = row
        .iter()
        .chain([&b, &delta])
        .fold(true, |ok, &x| ok & (x * scale * back == x));
    if exact { scale } else { 1.0 }
}
