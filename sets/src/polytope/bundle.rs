//! Zonotope bundles: a polytope as the intersection of rotated boxes.
//!
//! One frame a facet normal, so the intersection is the polytope. The frames are f64 matrices C that are
//! orthonormal up to rounding; a box is { x : C x ∈ range } for that very C, and where x is needed from C x
//! the inverse is an interval matrix. So nothing rests on C being orthonormal.

use super::{Polytope, axis, parallel, unit};
use crate::lp::LinearProgram;
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

    /// C, n × n, its rows orthonormal up to rounding.
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
    /// Two linear programs a row of a frame. Fails with `Empty` or `NotFinite`.
    ///
    /// Source: \[Khajenejad, Sec. II\]: polytopes and zonotope bundles are transformed into each other.
    pub fn frames(&self, lp: &mut LinearProgram) -> Result<Vec<Frame>, SetError> {
        let set = self.to_constrained_zonotope()?;
        set.load(lp)?;
        let mut frames: Vec<Frame> = Vec::new();
        for slab in &self.slabs {
            if axis(&slab.normal).is_some() {
                if !frames.iter().any(Frame::is_identity) {
                    frames.push(Frame::identity(&self.hull));
                }
                continue;
            }
            if frames.len() == MOST_FRAMES {
                break;
            }
            let Some(normal) = unit(&slab.normal) else {
                continue;
            };
            let known = frames
                .iter()
                .any(|f| !f.identity && parallel(f.to.row(0), &normal));
            if known {
                continue;
            }
            let to = completed(&normal)?;
            let back = inverse(&to)?;
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
