//! Volume in up to three dimensions.

use super::ConstrainedZonotope;
use super::planar::NEAR;
use crate::SetError;
use crate::lp::LinearProgram;
use crate::polytope::spatial::Polyhedron;
use crate::units::times;

impl ConstrainedZonotope {
    /// Length, area or volume for n = 1, 2, 3, rounded to nearest; `None` in higher dimensions.
    ///
    /// r does not enter. Fails with `Empty` if the set is proved empty.
    pub fn volume(&self) -> Result<Option<f64>, SetError> {
        match self.dim() {
            1 => Ok(Some(self.interval_hull()?[0].width())),
            2 => self.area().map(Some),
            3 => self.volume_3d().map(Some),
            _ => Ok(None),
        }
    }

    fn volume_3d(&self) -> Result<f64, SetError> {
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        let units = self.units();
        let body = Polyhedron::grow(3.0 * NEAR, |d| self.extreme_in(&units, d, &mut lp))?;
        Ok(body.map_or(0.0, |body| times(body.volume(), &units)))
    }
}
