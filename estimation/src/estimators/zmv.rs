//! ZMV and ZFO: zonotopes through the mean value or the first-order Taylor extension, and strips.

use super::measurement::MeasurementSettings;
use super::scale::{Scale, Units};
use super::set_membership::{Model, ZonotopeBelief};
use crate::error::before;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::propagation::{Dynamics, zonotope_first_order, zonotope_mean_value};
use crate::{AnySystem, EstimationError, Problem, System};
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
    /// How a measurement that is not linear is taken in.
    #[serde(default, skip_serializing_if = "MeasurementSettings::is_default")]
    pub measurement: MeasurementSettings,
}

impl ZonotopeFilterSettings {
    /// So many generators, and else what is the default.
    pub fn new(generators: usize) -> Self {
        Self {
            generators,
            scale: Scale::default(),
            measurement: MeasurementSettings::default(),
        }
    }
}

/// The zonotope filter of either extension.
#[derive(Clone, Debug)]
struct ZonotopeFilter<Y> {
    model: Model<Y>,
    prior: Zonotope,
    w: Zonotope,
    generators: usize,
    units: Units,
    passes: usize,
}

impl<Y: System> ZonotopeFilter<Y> {
    fn new(
        kind: &'static str,
        settings: &ZonotopeFilterSettings,
        problem: &Problem<Y>,
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
            passes: settings.measurement.passes(kind)?,
        })
    }

    /// Each measured component is a strip; then the order is reduced.
    fn update(
        &self,
        k: usize,
        belief: &ZonotopeBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ZonotopeBelief, EstimationError> {
        let at = EstimationError::at(k, "update");
        let mut set = belief.set.clone();
        let (mut cut, mut left_out) = (false, List::new());
        for _ in 0..self.passes {
            let hull = || set.interval_hull().map_err(&at);
            let Some(reading) = self.model.read(k, u, y, hull)? else {
                break;
            };
            left_out = reading.left_out;
            let Some((c, target)) = reading.strips else {
                break;
            };
            let half = target.zonotope().radius();
            for (i, &half) in half.iter().enumerate() {
                set = strip::intersect(&set, c.row(i), target.c()[i], half).map_err(&at)?;
            }
            cut = true;
            if reading.exact {
                break;
            }
        }
        // Where nothing was read, only what has grown is reduced.
        if cut || set.generators() > self.generators {
            set = self
                .units
                .zonotope(&set.fold(), |set| yang_scott::reduce(set, self.generators))
                .map_err(EstimationError::at(k, "reduction"))?;
        }
        Ok(ZonotopeBelief { set, left_out })
    }

    fn predict(
        &self,
        k: usize,
        set: &Zonotope,
        u: &[f64],
        extension: impl Fn(&Dynamics<Y>, &Zonotope, &Zonotope) -> Result<Zonotope, SetError>,
    ) -> Result<Zonotope, EstimationError> {
        let f = self.model.dynamics(before(k)?, u)?;
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
        pub struct $name<Y = AnySystem>(ZonotopeFilter<Y>);

        impl<Y: System> $name<Y> {
            /// Fails where a part of the problem has no set, `generators` is below n, or a setting is out of range.
            pub fn new(settings: &ZonotopeFilterSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
                ZonotopeFilter::new($kind, settings, problem).map(Self)
            }
        }

        impl<Y: System> Estimator for $name<Y> {
            type Belief = ZonotopeBelief;
            fn prior(&self) -> ZonotopeBelief {
                self.0.prior.clone().into()
            }
            fn predict(&self, k: usize, belief: &ZonotopeBelief, u: &[f64]) -> Result<ZonotopeBelief, EstimationError> {
                let set = self.0.predict(k, &belief.set, u, |f, x, w| $extension(f, x, w))?;
                Ok(set.into())
            }
            /// Takes in y_k and reduces the order: the paper reports the reduced set.
            fn update(
                &self,
                k: usize,
                belief: &ZonotopeBelief,
                u: &[f64],
                y: Measurement,
            ) -> Result<ZonotopeBelief, EstimationError> {
                self.0.update(k, belief, u, y)
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
    /// predict ⟨f(c), [mid J G, diag P, mid J_w G_w]⟩, update by Bravo's strips, reduce by Method 4. A measurement that is not
    /// linear gives strips by its mean value form.
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
