//! Boxes: vectors of intervals.

use crate::{Interval, List, SetError};
use std::ops::Index;

/// A box \[x₁\] × … × \[x_n\].
///
/// What is made from given bounds is finite. The result of arithmetic may be unbounded, when a function
/// left its domain or a bound overflowed; [`IntervalVector::finite`] turns that into an error.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct IntervalVector(List<Interval>);

impl IntervalVector {
    /// The box with these sides.
    pub fn new(sides: impl Into<List<Interval>>) -> Self {
        Self(sides.into())
    }

    /// [lower, upper], componentwise.
    ///
    /// Fails with `Dimension` if the lengths differ, `NotFinite` at a NaN or infinite bound, `Reversed`
    /// where lower > upper.
    pub fn from_bounds(lower: &[f64], upper: &[f64]) -> Result<Self, SetError> {
        same_dimension("box", lower.len(), upper.len())?;
        let side = |(index, (&lo, &hi))| {
            Interval::new(lo, hi).map_err(|error| match error {
                SetError::Reversed { lower, upper, .. } => SetError::Reversed {
                    op: "box",
                    index,
                    lower,
                    upper,
                },
                SetError::NotFinite { value, .. } => SetError::NotFinite { op: "box", value },
                other => other,
            })
        };
        Ok(Self(
            lower
                .iter()
                .zip(upper)
                .enumerate()
                .map(side)
                .collect::<Result<_, _>>()?,
        ))
    }

    /// A box containing { x : |x − center| ≤ radius }, bounds rounded outward.
    ///
    /// Fails with `Dimension` if the lengths differ, `NotFinite` at a NaN, infinite or overflowing
    /// number, `Reversed` at a negative radius.
    pub fn from_center_radius(center: &[f64], radius: &[f64]) -> Result<Self, SetError> {
        const OP: &str = "box from center and radius";
        same_dimension(OP, center.len(), radius.len())?;
        let side = |(index, (&c, &r)): (usize, (&f64, &f64))| {
            if let Some(&value) = [c, r].iter().find(|x| !x.is_finite()) {
                return Err(SetError::NotFinite { op: OP, value });
            }
            if r < 0.0 {
                return Err(SetError::Reversed {
                    op: OP,
                    index,
                    lower: c - r,
                    upper: c + r,
                });
            }
            let side = Interval::from_center_radius(c, r);
            if side.is_finite() {
                Ok(side)
            } else {
                Err(SetError::NotFinite {
                    op: OP,
                    value: side.mag(),
                })
            }
        };
        Ok(Self(
            center
                .iter()
                .zip(radius)
                .enumerate()
                .map(side)
                .collect::<Result<_, _>>()?,
        ))
    }

    /// The box that holds the one point `x`; fails with `NotFinite` at a NaN or infinite component.
    pub fn point(x: &[f64]) -> Result<Self, SetError> {
        Self::from_bounds(x, x)
    }

    /// Number of components.
    #[inline]
    pub fn dim(&self) -> usize {
        self.0.len()
    }

    /// The sides.
    #[inline]
    pub fn as_slice(&self) -> &[Interval] {
        &self.0
    }

    /// The sides, given away.
    pub fn into_sides(self) -> Vec<Interval> {
        self.0.into_vec()
    }

    /// The sides in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Interval> {
        self.0.iter()
    }

    /// The lower bounds.
    pub fn lower(&self) -> Vec<f64> {
        self.0.iter().map(|x| x.lo()).collect()
    }

    /// The upper bounds.
    pub fn upper(&self) -> Vec<f64> {
        self.0.iter().map(|x| x.hi()).collect()
    }

    /// A point of the box near its middle.
    pub fn mid(&self) -> List<f64> {
        self.0.iter().map(|x| x.mid()).collect()
    }

    /// Upper bounds on the distances from [`IntervalVector::mid`], componentwise.
    pub fn rad(&self) -> List<f64> {
        self.0.iter().map(|x| x.rad()).collect()
    }

    /// Upper bounds on upper − lower.
    pub fn widths(&self) -> Vec<f64> {
        self.0.iter().map(|x| x.width()).collect()
    }

    /// max |x|, componentwise, exact.
    pub fn mag(&self) -> Vec<f64> {
        self.0.iter().map(|x| x.mag()).collect()
    }

    /// True if all bounds are finite.
    pub fn is_finite(&self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }

    /// The box itself if it is finite, else the error `Domain` of the operation `op`.
    pub fn finite(self, op: &'static str) -> Result<Self, SetError> {
        for side in &self.0 {
            side.finite(op)?;
        }
        Ok(self)
    }

    /// The product of these boxes, in order.
    pub fn stack(boxes: &[&Self]) -> Self {
        Self(boxes.iter().flat_map(|b| b.0.iter().copied()).collect())
    }

    /// The projection to the components with these indices, in this order.
    pub fn select(&self, indices: &[usize]) -> Self {
        Self(indices.iter().map(|&i| self.0[i]).collect())
    }

    /// The intersection, exact. Fails with `Empty` if it is empty, `Dimension` if dimensions differ.
    pub fn intersect(&self, other: &Self) -> Result<Self, SetError> {
        const OP: &str = "intersection of boxes";
        same_dimension(OP, self.dim(), other.dim())?;
        let sides = self.0.iter().zip(&other.0);
        let sides: Option<List<Interval>> = sides.map(|(a, b)| a.intersect(b)).collect();
        Ok(Self(sides.ok_or(SetError::Empty { op: OP })?))
    }

    /// The smallest box containing both, exact. Fails with `Dimension` if dimensions differ.
    pub fn hull(&self, other: &Self) -> Result<Self, SetError> {
        same_dimension("hull of boxes", self.dim(), other.dim())?;
        Ok(Self(
            self.0
                .iter()
                .zip(&other.0)
                .map(|(a, b)| a.hull(b))
                .collect(),
        ))
    }

    /// { x + y }, rounded outward. Fails with `Dimension` if dimensions differ.
    pub fn minkowski_sum(&self, other: &Self) -> Result<Self, SetError> {
        same_dimension("Minkowski sum of boxes", self.dim(), other.dim())?;
        Ok(Self(
            self.0.iter().zip(&other.0).map(|(&a, &b)| a + b).collect(),
        ))
    }

    /// { x − y }, rounded outward. Fails with `Dimension` if dimensions differ.
    pub fn difference(&self, other: &Self) -> Result<Self, SetError> {
        same_dimension("difference of boxes", self.dim(), other.dim())?;
        Ok(Self(
            self.0.iter().zip(&other.0).map(|(&a, &b)| a - b).collect(),
        ))
    }

    /// True if `x` lies in the box; false if it has another dimension.
    pub fn contains(&self, x: &[f64]) -> bool {
        self.dim() == x.len() && self.0.iter().zip(x).all(|(a, &x)| a.contains(x))
    }

    /// True if `inner` ⊆ this box; false if it has another dimension.
    pub fn contains_box(&self, inner: &Self) -> bool {
        self.dim() == inner.dim()
            && self
                .0
                .iter()
                .zip(&inner.0)
                .all(|(a, &b)| a.contains_interval(b))
    }
}

pub(crate) fn same_dimension(
    op: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), SetError> {
    if expected == got {
        Ok(())
    } else {
        Err(SetError::Dimension { op, expected, got })
    }
}

impl Index<usize> for IntervalVector {
    type Output = Interval;
    #[inline]
    fn index(&self, i: usize) -> &Interval {
        &self.0[i]
    }
}

impl FromIterator<Interval> for IntervalVector {
    fn from_iter<I: IntoIterator<Item = Interval>>(sides: I) -> Self {
        Self(sides.into_iter().collect())
    }
}

impl<'a> IntoIterator for &'a IntervalVector {
    type Item = &'a Interval;
    type IntoIter = std::slice::Iter<'a, Interval>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}
