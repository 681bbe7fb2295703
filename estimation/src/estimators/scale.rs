//! The units in which a filter compares components with each other.
//!
//! Most steps do not: hulls, supports, intersections and gains are the same in any units. What does, by its definition, is
//! a norm over components: the keys of Girard's and Combastel's reductions, Yang and Scott's block, Scott's scores, the
//! least distance Σ_j |h_j − c_j| of a point of expansion, |M| of a covariance's bound. Taken as the state stands, a
//! kilometre counts a thousand times more than in metres. With `scale = "prior"` every component is first divided by the
//! power of two nearest to its half-width in the prior, and then nothing depends on the units of the file.

use crate::Uncertain;
use serde::{Deserialize, Serialize};
use zonobench_sets::number::{Function, Real};
use zonobench_sets::units::{divided_rows, multiplied_rows, nearest_power};
use zonobench_sets::{
    ConstrainedZonotope, Interval, IntervalVector, List, Matrix, SetError, Zonotope,
};

/// In which units components are compared where a method compares them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// In those of the state, as the papers do.
    #[default]
    None,
    /// In the powers of two nearest to the prior's half-widths: Σ_j |G_ij| + √P_ii. A component that the prior knows
    /// exactly has |c_i|, and 1 where that is 0.
    Prior,
}

impl Scale {
    /// True for the default, which is not written to files.
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }

    /// The units for a state of this prior.
    pub(super) fn units(self, prior: &Uncertain) -> Units {
        Units(match self {
            Self::None => None,
            Self::Prior => {
                let (g, p) = (prior.generator_matrix(), prior.covariance_matrix());
                let center = prior.mixed_mean();
                let size = |i: usize| {
                    let row: f64 = g.row(i).iter().map(|x| x.abs()).sum();
                    let half = row + p[(i, i)].max(0.0).sqrt();
                    nearest_power(if half > 0.0 { half } else { center[i] })
                };
                Some((0..prior.dim()).map(size).collect())
            }
        })
    }
}

/// Powers of two, one a component; none where components are taken as they are.
#[derive(Clone, Debug)]
pub(super) struct Units(Option<List<f64>>);

impl Units {
    /// `method` of the set in these units, in the state's own again.
    pub fn zonotope(
        &self,
        z: &Zonotope,
        method: impl Fn(&Zonotope) -> Result<Zonotope, SetError>,
    ) -> Result<Zonotope, SetError> {
        match &self.0 {
            None => method(z),
            Some(units) => method(&z.divided_by(units)?)?.multiplied_by(units),
        }
    }

    /// The same of a constrained zonotope, whose constraints are measured each by its largest coefficient.
    pub fn constrained(
        &self,
        x: &ConstrainedZonotope,
        method: impl FnOnce(&ConstrainedZonotope) -> Result<ConstrainedZonotope, SetError>,
    ) -> Result<ConstrainedZonotope, SetError> {
        match &self.0 {
            None => method(x),
            Some(units) => method(&x.divided_by(units)?)?.multiplied_by(units),
        }
    }

    /// The same of bare columns, rounded to nearest.
    pub fn columns(&self, g: &Matrix, method: impl Fn(&Matrix) -> Matrix) -> Matrix {
        match &self.0 {
            None => method(g),
            Some(units) => multiplied_rows(&method(&divided_rows(g, units)), units),
        }
    }

    /// u, where there is one.
    pub fn as_slice(&self) -> Option<&[f64]> {
        self.0.as_ref().map(|units| &units[..])
    }
}

/// (x, w) ↦ diag(u)⁻¹ f(diag(u) x, w): f of a state in other units.
pub(super) struct InUnits<'a, F> {
    pub f: &'a F,
    pub units: &'a [f64],
}

impl<F: Function> Function for InUnits<'_, F> {
    fn inputs(&self) -> usize {
        self.f.inputs()
    }
    fn outputs(&self) -> usize {
        self.f.outputs()
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        let own = |(i, &z): (usize, &S)| self.units.get(i).map_or(z, |&u| z * u);
        let own: List<S> = z.iter().enumerate().map(own).collect();
        self.f.evaluate(&own, out);
        for (y, u) in out.iter_mut().zip(self.units) {
            *y = *y * (1.0 / u);
        }
    }
}

/// diag(u)⁻¹ of a box.
pub(super) fn divided_box(x: &IntervalVector, units: &[f64]) -> IntervalVector {
    x.iter()
        .zip(units)
        .map(|(&side, u)| side * Interval::point(1.0 / u))
        .collect()
}
