//! Zonotope bundles: a polytope as the intersection of rotated boxes.
//!
//! One frame a facet normal, so the intersection is the polytope. The frames are f64 matrices C that are
//! orthonormal up to rounding in units of the polytope's half-widths; a box is { x : C x ∈ range } for that very C, and
//! where x is needed from C x the inverse is an interval matrix. So nothing rests on C being orthonormal.

use super::{Polytope, parallel, unit};
use crate::lp::LinearProgram;
use crate::units::of_set;
use crate::{Interval, rounding};
use crate::{IntervalMatrix, IntervalVector, Matrix, SetError};

/// A bundle has no more frames than this. Every frame holds the polytope, so one left out is no loss of
/// soundness.
const MOST_FRAMES: usize = 24;

/// The box { x : C x ∈ range } in the coordinates t = C x.
#[derive(Clone, Debug)]
pub struct Frame {
    to: Matrix,
    back: IntervalMatrix,
    range: IntervalVector,
    identity: bool,
}

impl Frame {
    /// The box in its own coordinates: C = I.
    pub fn identity(hull: &IntervalVector) -> Self {
        let n = hull.dim();
        Self {
            to: Matrix::identity(n),
            back: IntervalMatrix::identity(n),
            range: hull.clone(),
            identity: true,
        }
    }

    /// C, n × n: C diag(u) has orthonormal rows up to rounding, u the powers of two at or below the half-widths of the
    /// polytope's hull.
    pub fn to(&self) -> &Matrix {
        &self.to
    }

    /// Contains C⁻¹.
    pub fn back(&self) -> &IntervalMatrix {
        &self.back
    }

    /// The box of t = C x.
    pub fn range(&self) -> &IntervalVector {
        &self.range
    }

    /// True if C = I.
    pub fn is_identity(&self) -> bool {
        self.identity
    }

    /// The frame of (x, e) with e as it is: diag(C, I), and the range of t beside `e`.
    pub fn beside(&self, e: &IntervalVector) -> Self {
        let (n, p) = (self.to.rows(), e.dim());
        let within = |i: usize, j: usize| i < n && j < n;
        let unit = |i: usize, j: usize| f64::from(i == j);
        Self {
            to: Matrix::from_fn(n + p, n + p, |i, j| {
                if within(i, j) {
                    self.to[(i, j)]
                } else {
                    unit(i, j)
                }
            }),
            back: IntervalMatrix::from_fn(n + p, n + p, |i, j| {
                if within(i, j) {
                    self.back[(i, j)]
                } else {
                    Interval::point(unit(i, j))
                }
            }),
            range: IntervalVector::stack(&[&self.range, e]),
            identity: self.identity,
        }
    }

    /// A box in x that contains the frame's box: C⁻¹ range.
    pub fn hull(&self) -> IntervalVector {
        if self.identity {
            self.range.clone()
        } else {
            self.back.mul_vec(&self.range)
        }
    }
}

impl Polytope {
    /// The frames whose boxes intersect in the polytope: one a facet normal a, by Gram and Schmidt from a and
    /// the coordinate vectors in the order of their index, without the one where |a_j| is largest; all
    /// normals along axes share the hull's. No two frames have the same normal; there are at most 24, and the
    /// intersection may be larger than the polytope if that is not enough.
    ///
    /// "Orthonormal" and "largest" are meant in units of the hull's half-widths (the powers of two at or below them): a
    /// box that is turned in a plane of metres and radians would otherwise be another one in km.
    ///
    /// Two linear programs a row of a frame. Fails with `Empty` or `NotFinite`.
    ///
    /// Source: \[Khajenejad, Sec. II\]: polytopes and zonotope bundles are transformed into each other.
    pub fn frames(&self, lp: &mut LinearProgram) -> Result<Vec<Frame>, SetError> {
        let set = self.to_constrained_zonotope()?;
        set.load(lp)?;
        let units = of_set(&self.hull.mid(), &self.hull.rad());
        let mut frames: Vec<Frame> = Vec::new();
        let mut normals: Vec<Vec<f64>> = Vec::new();
        for slab in &self.slabs {
            if slab.side().is_some() {
                if !frames.iter().any(Frame::is_identity) {
                    frames.push(Frame::identity(&self.hull));
                }
                continue;
            }
            if frames.len() == MOST_FRAMES {
                break;
            }
            let scaled: Vec<f64> = slab.normal.iter().zip(&units).map(|(a, u)| a * u).collect();
            let Some(normal) = unit(&scaled) else {
                continue;
            };
            if normals.iter().any(|a| parallel(a, &normal)) {
                continue;
            }
            let (to, back) = in_own_units(completed(&normal)?, &units)?;
            normals.push(normal);
            let mut range = Vec::with_capacity(to.rows());
            for i in 0..to.rows() {
                let row = to.row(i);
                let minus: Vec<f64> = row.iter().map(|x| -x).collect();
                let upper = set.support_loaded(row, lp)?;
                let lower = -set.support_loaded(&minus, lp)?;
                range.push(super::ordered(lower, upper)?);
            }
            frames.push(Frame {
                to,
                back,
                range: IntervalVector::new(range),
                identity: false,
            });
        }
        if frames.is_empty() {
            frames.push(Frame::identity(&self.hull));
        }
        Ok(frames)
    }
}

/// C diag(u)⁻¹ for a nearly orthonormal C, and an enclosure of its inverse diag(u) C⁻¹; C itself where an entry would
/// underflow, because the enclosure is that of the very matrix returned.
fn in_own_units(c: Matrix, units: &[f64]) -> Result<(Matrix, IntervalMatrix), SetError> {
    let back = inverse(&c)?;
    let n = c.rows();
    let own = Matrix::from_fn(n, n, |i, j| c[(i, j)] / units[j]);
    let exact = (0..n).all(|i| (0..n).all(|j| own[(i, j)] * units[j] == c[(i, j)]));
    if !exact {
        return Ok((c, back));
    }
    let own_back = IntervalMatrix::from_fn(n, n, |i, j| back[(i, j)] * units[i]);
    Ok((own, own_back))
}

/// The rows of an orthonormal matrix that begins with `a`, rounded to nearest.
fn completed(a: &[f64]) -> Result<Matrix, SetError> {
    let n = a.len();
    let largest = (0..n).fold(0, |m, j| if a[j].abs() > a[m].abs() { j } else { m });
    let mut rows: Vec<Vec<f64>> = vec![a.to_vec()];
    for j in (0..n).filter(|&j| j != largest) {
        let mut row: Vec<f64> = (0..n).map(|i| f64::from(i == j)).collect();
        // Twice, which leaves nothing but rounding.
        for _ in 0..2 {
            for known in &rows {
                let along = crate::matrix::dot(&row, known);
                row.iter_mut().zip(known).for_each(|(x, k)| *x -= along * k);
            }
        }
        rows.push(unit(&row).ok_or(SetError::Singular { op: "frame" })?);
    }
    Matrix::from_rows(&rows)
}

/// Contains C⁻¹ = Cᵀ (C Cᵀ)⁻¹ for a C that is nearly orthonormal.
///
/// With E = I − C Cᵀ and e ≥ ‖E‖∞ < 1/2, (I − E)⁻¹ = I + F, ‖F‖∞ ≤ e/(1 − e); so every entry of C⁻¹ − Cᵀ = CᵀF
/// is at most |Cᵀ| 1 · e/(1 − e).
fn inverse(c: &Matrix) -> Result<IntervalMatrix, SetError> {
    let n = c.rows();
    let product = IntervalMatrix::from(c).mul_matrix(&c.transpose());
    let e = IntervalMatrix::identity(n).sub(&product).norm_inf();
    if e.is_nan() || e >= 0.5 {
        return Err(SetError::Singular { op: "frame" });
    }
    let spread = rounding::up(2.0 * e, 1);
    let sums = c.transpose().abs_row_sums();
    Ok(IntervalMatrix::from_fn(n, n, |i, j| {
        Interval::from_center_radius(c[(j, i)], rounding::up(sums[i] * spread, n + 1))
    }))
}
