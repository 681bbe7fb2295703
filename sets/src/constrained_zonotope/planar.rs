//! Vertices, support vectors and area in the plane.

use super::ConstrainedZonotope;
use super::same;
use crate::lp::LinearProgram;
use crate::polytope::planar::Polygon;
use crate::units::{of_set, times};
use crate::{List, SetError};

/// Points closer than this times the size of the set, component by component, are the same vertex.
pub(super) const NEAR: f64 = 1e-10;

impl ConstrainedZonotope {
    /// The vertices of a set of the plane, counter-clockwise from the lowest; a segment has 2, a point 1.
    ///
    /// Rounded to nearest: vertices are for drawing and measuring, not a bound; r does not enter.
    /// Fails with `Dimension` unless n = 2, with `Empty` if the set is proved empty.
    pub fn vertices(&self) -> Result<Vec<[f64; 2]>, SetError> {
        let units = self.units();
        let [x, y] = [self.c()[0], self.c()[self.dim() - 1]];
        let own = |o: [f64; 2]| [x + o[0] * units[0], y + o[1] * units[1]];
        Ok(self.polygon(&units)?.points.into_iter().map(own).collect())
    }

    /// A point of { c + G ξ : |ξ| ≤ 1, |A ξ − b| ≤ δ } where dᵀx is greatest, rounded to nearest; r does
    /// not enter.
    ///
    /// Fails with `Dimension`, `NotFinite`, or `Empty` if the set is proved empty.
    pub fn support_vector(&self, d: &[f64]) -> Result<Vec<f64>, SetError> {
        same("support vector", self.dim(), d.len())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        self.extreme_offset(d, &mut lp)?;
        Ok(self.at(lp.point()))
    }

    /// G ξ of the support vector, the constraints being in `lp` already.
    fn extreme_offset(&self, d: &[f64], lp: &mut LinearProgram) -> Result<List<f64>, SetError> {
        let mut along = vec![0.0; self.generators()];
        for (i, &d) in d.iter().enumerate() {
            for (t, &g) in along.iter_mut().zip(self.g().row(i)) {
                *t += d * g;
            }
        }
        super::empty_in(
            "extreme point of a constrained zonotope",
            lp.maximize(&along),
        )?;
        Ok(self.g().mul_vec(lp.point()))
    }

    /// c + G ξ.
    pub(crate) fn at(&self, xi: &[f64]) -> Vec<f64> {
        let offset = self.g().mul_vec(xi);
        self.c().iter().zip(&offset).map(|(c, o)| c + o).collect()
    }

    /// In units of the generators' box about the center.
    fn polygon(&self, units: &[f64]) -> Result<Polygon, SetError> {
        same("vertices", 2, self.dim())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        Polygon::grow(2.0 * NEAR, |d| self.extreme_in(units, d, &mut lp))
    }

    /// Units of the generators' box.
    pub(super) fn units(&self) -> List<f64> {
        of_set(self.c(), &self.z.radius())
    }

    /// dᵀo and o for the o = diag(u)⁻¹ G ξ of the set where dᵀo is greatest. Nothing is bounded here: the value at the
    /// point does for the support.
    pub(super) fn extreme_in<const N: usize>(
        &self,
        units: &[f64],
        d: [f64; N],
        lp: &mut LinearProgram,
    ) -> Result<(f64, [f64; N]), SetError> {
        let own: [f64; N] = std::array::from_fn(|i| d[i] / units[i]);
        let offset = self.extreme_offset(&own, lp)?;
        let point: [f64; N] = std::array::from_fn(|i| offset[i] / units[i]);
        let along = d.iter().zip(&point).map(|(d, x)| d * x).sum();
        Ok((along, point))
    }

    /// The area of the polygon of the vertices.
    pub(super) fn area(&self) -> Result<f64, SetError> {
        let units = self.units();
        Ok(times(self.polygon(&units)?.area(), &units))
    }
}
