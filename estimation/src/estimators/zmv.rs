//! ZMV and ZFO: zonotopes through the mean value or the first-order Taylor extension, and strips.

use super::scale::{Scale, Units};
use super::set_membership::{Model, ZonotopeBelief};
use crate::estimator::{Estimator, Measurement, Phase};
use crate::propagation::{Dynamics, zonotope_first_order, zonotope_mean_value};
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use zonobench_sets::reduction::yang_scott;
use zonobench_sets::{List, SetError, Zonotope, strip};

/// Settings of `zmv` and `zfo`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZonotopeFilterSettings {
    /// The number of generators kept; at least n.
    pub generators: usize,
    /// In which units generators are compared when the order is reduced; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
}

/// The zonotope filter of either extension.
#[derive(Clone, Debug)]
struct ZonotopeFilter {
    model: Model,
    prior: Zonotope,
    w: Zonotope,
    generators: usize,
    units: Units,
}

impl ZonotopeFilter {
    fn new(
        kind: &'static str,
        settings: &ZonotopeFilterSettings,
        problem: &Problem,
    ) -> Result<Self, EstimationError> {
        let model = Model::new(kind, problem)?;
        let n = model.prior.dim();
        if settings.generators < n {
            let expected = format!("at least the dimension {n}");
            return Err(EstimationError::setting(
                kind,
                "generators",
                expected,
                settings.generators,
            ));
        }
        // A zonotope knows no constraints: without them the sets are larger.
        let (prior, w) = (model.prior.zonotope().clone(), model.w.zonotope().clone());
        Ok(Self {
            model,
            prior,
            w,
            generators: settings.generators,
            units: settings.scale.units(&problem.prior),
        })
    }

    /// Each measured component is a strip; then the order is reduced.
    fn update(
        &self,
        k: usize,
        set: &Zonotope,
        u: &[f64],
        y: Measurement,
    ) -> Result<Zonotope, EstimationError> {
        let mut set = set.clone();
        match self.model.observe(k, u, y)? {
            Some((c, target)) => {
                let half = target.zonotope().radius();
                for (i, &half) in half.iter().enumerate() {
                    let cut = strip::intersect(&set, c.row(i), target.c()[i], half);
                    set = cut.map_err(EstimationError::at(k, "update"))?;
                }
            }
            // Nothing measured: only what has grown is reduced.
            None if set.generators() <= self.generators => return Ok(set),
            None => {}
        }
        self.units
            .zonotope(&set.fold(), |set| yang_scott::reduce(set, self.generators))
            .map_err(EstimationError::at(k, "reduction"))
    }

    fn predict(
        &self,
        k: usize,
        set: &Zonotope,
        u: &[f64],
        extension: impl Fn(
            &Dynamics<crate::AnySystem>,
            &Zonotope,
            &Zonotope,
        ) -> Result<Zonotope, SetError>,
    ) -> Result<Zonotope, EstimationError> {
        let f = self.model.dynamics(k - 1, u)?;
        extension(&f, set, &self.w)
            .and_then(|image| without_zero_columns(&image))
            .map_err(EstimationError::at(k, "prediction"))
    }
}

/// The same set without generators that are 0: products with a variable that enters linearly.
fn without_zero_columns(z: &Zonotope) -> Result<Zonotope, SetError> {
    let counts = |j: &usize| (0..z.dim()).any(|i| z.g()[(i, *j)] != 0.0);
    let kept: List<usize> = (0..z.generators()).filter(counts).collect();
    Zonotope::with_rounding(z.c(), z.g().select_columns(&kept), z.r())
}

macro_rules! zonotope_filter {
    ($(#[$doc:meta])* $name:ident, $kind:literal, $extension:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub struct $name(ZonotopeFilter);

        impl $name {
            /// Fails where the measurement is not linear, a part of the problem has no set, or `generators`
            /// is below n.
            pub fn new(settings: &ZonotopeFilterSettings, problem: &Problem) -> Result<Self, EstimationError> {
                ZonotopeFilter::new($kind, settings, problem).map(Self)
            }
        }

        impl Estimator for $name {
            type Belief = ZonotopeBelief;
            fn prior(&self) -> ZonotopeBelief {
                ZonotopeBelief { set: self.0.prior.clone() }
            }
            fn predict(&self, k: usize, belief: &ZonotopeBelief, u: &[f64]) -> Result<ZonotopeBelief, EstimationError> {
                let set = self.0.predict(k, &belief.set, u, |f, x, w| $extension(f, x, w))?;
                Ok(ZonotopeBelief { set })
            }
            /// Takes in y_k and reduces the order: the paper reports the reduced set.
            fn update(
                &self,
                k: usize,
                belief: &ZonotopeBelief,
                u: &[f64],
                y: Measurement,
            ) -> Result<ZonotopeBelief, EstimationError> {
                Ok(ZonotopeBelief { set: self.0.update(k, &belief.set, u, y)? })
            }
            fn guaranteed(&self) -> bool {
                true
            }
            fn reads(&self) -> &'static str {
                "y_0 ... y_{k-1} (predicted), y_0 ... y_k (updated)"
            }
            fn reported_phase(&self) -> Phase {
                Phase::Updated
            }
        }
    };
}

zonotope_filter!(
    /// The zonotope filter by the mean value extension:
    /// predict ⟨f(c), [mid J G, diag P, mid J_w G_w]⟩, update by Bravo's strips, reduce by Method 4.
    ///
    /// Guaranteed: x_k lies in every set if the assumptions hold. Constraints of the prior or a noise are
    /// left out. Source: Alamo, Bravo, Camacho 2005, as compared in [Rego2020, Sec. 6].
    Zmv,
    "zmv",
    zonotope_mean_value
);

zonotope_filter!(
    /// The zonotope filter by the first-order Taylor extension:
    /// predict ⟨f(c) + c̃, [∇f G, G̃, diag d]⟩, update by Bravo's strips, reduce by Method 4.
    ///
    /// Guaranteed as [`Zmv`]. Source: Combastel 2005, as compared in [Rego2020, Sec. 6].
    Zfo,
    "zfo",
    zonotope_first_order
);
