//! Vertices, support vectors and area in the plane.

use super::ConstrainedZonotope;
use super::same;
use crate::SetError;
use crate::lp::LinearProgram;
use crate::polytope::planar::Polygon;

/// Points closer than this times the size of the set are the same vertex.
pub(super) const NEAR: f64 = 1e-10;

impl ConstrainedZonotope {
    /// The vertices of a set of the plane, counter-clockwise from the lowest; a segment has 2, a point 1.
    ///
    /// Rounded to nearest: vertices are for drawing and measuring, not a bound; r does not enter.
    /// Fails with `Dimension` unless n = 2, with `Empty` if the set is proved empty.
    pub fn vertices(&self) -> Result<Vec<[f64; 2]>, SetError> {
        Ok(self.polygon()?.points)
    }

    /// A point of { c + G ξ : |ξ| ≤ 1, |A ξ − b| ≤ δ } where dᵀx is greatest, rounded to nearest; r does
    /// not enter.
    ///
    /// Fails with `Dimension`, `NotFinite`, or `Empty` if the set is proved empty.
    pub fn support_vector(&self, d: &[f64]) -> Result<Vec<f64>, SetError> {
        same("support vector", self.dim(), d.len())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        self.extreme_point(d, &mut lp)
    }

    /// The support vector, the constraints being in `lp` already.
    pub(super) fn extreme_point(
        &self,
        d: &[f64],
        lp: &mut LinearProgram,
    ) -> Result<Vec<f64>, SetError> {
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
        Ok(self.at(lp.point()))
    }

    /// c + G ξ.
    pub(crate) fn at(&self, xi: &[f64]) -> Vec<f64> {
        let offset = self.g().mul_vec(xi);
        self.c().iter().zip(&offset).map(|(c, o)| c + o).collect()
    }

    fn polygon(&self) -> Result<Polygon, SetError> {
        same("vertices", 2, self.dim())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        let hull = self.z.radius();
        Polygon::grow(NEAR * (hull[0] + hull[1]), |d| {
            let v = self.extreme_point(&d, &mut lp)?;
            // Nothing is bounded here: the value at the point does for the support.
            Ok((d[0] * v[0] + d[1] * v[1], [v[0], v[1]]))
        })
    }

    /// The area of the polygon of the vertices.
    pub(super) fn area(&self) -> Result<f64, SetError> {
        Ok(self.polygon()?.area())
    }
}
