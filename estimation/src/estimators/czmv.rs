//! CZMV and CZFO: constrained zonotopes through the mean value or the first-order Taylor extension, with
//! exact intersections.

use super::measurement::MeasurementSettings;
use super::scale::{InUnits, Scale, Units, divided_box};
use super::set_membership::{ConstrainedBelief, Model};
use crate::error::before;
use crate::estimator::{Estimator, Measurement, Phase};
use crate::propagation::{Choice, Expansion, Remainder, first_order, mean_value};
use crate::{AnySystem, EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::Function;
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, IntervalVector, List, SetError};

/// Settings of `czmv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CzmvSettings {
    /// The number of generators kept; at least n + `constraints`.
    pub generators: usize,
    /// The number of constraints kept.
    pub constraints: usize,
    /// The point that f is linearised about; `c2` unless given.
    #[serde(default = "c2")]
    pub h: Choice,
    /// In which units h is closest to another point, and generators and scores are compared; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
    /// How a measurement that is not linear is taken in.
    #[serde(default, skip_serializing_if = "MeasurementSettings::is_default")]
    pub measurement: MeasurementSettings,
}

impl CzmvSettings {
    /// So many generators and constraints, and else what is the default.
    pub fn new(generators: usize, constraints: usize) -> Self {
        Self {
            generators,
            constraints,
            h: c2(),
            scale: Scale::default(),
            measurement: MeasurementSettings::default(),
        }
    }
}

fn c2() -> Choice {
    Choice::C2
}

/// Settings of `czfo`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CzfoSettings {
    /// The number of generators kept; at least n + `constraints`.
    pub generators: usize,
    /// The number of constraints kept.
    pub constraints: usize,
    /// The point that f is expanded about; `c4` unless given.
    #[serde(default = "c4")]
    pub h: Choice,
    /// Whether constraints are multiplied with each other; `full` unless given.
    #[serde(default)]
    pub expansion: Expansion,
    /// Which remainder; `symmetric` unless given.
    #[serde(default)]
    pub remainder: Remainder,
    /// In which units h is closest to another point, and generators and scores are compared; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
    /// How a measurement that is not linear is taken in.
    #[serde(default, skip_serializing_if = "MeasurementSettings::is_default")]
    pub measurement: MeasurementSettings,
}

impl CzfoSettings {
    /// So many generators and constraints, and else what is the default.
    pub fn new(generators: usize, constraints: usize) -> Self {
        Self {
            generators,
            constraints,
            h: c4(),
            expansion: Expansion::default(),
            remainder: Remainder::default(),
            scale: Scale::default(),
            measurement: MeasurementSettings::default(),
        }
    }
}

fn c4() -> Choice {
    Choice::C4
}

/// How a set is propagated through any f, in whatever units.
trait Extension {
    fn of<F: Function>(
        &self,
        f: &F,
        x: &ConstrainedZonotope,
        hull: &IntervalVector,
        w: &ConstrainedZonotope,
        lp: &mut LinearProgram,
    ) -> Result<ConstrainedZonotope, SetError>;
}

struct MeanValue(Choice);

impl Extension for MeanValue {
    fn of<F: Function>(
        &self,
        f: &F,
        x: &ConstrainedZonotope,
        hull: &IntervalVector,
        w: &ConstrainedZonotope,
        lp: &mut LinearProgram,
    ) -> Result<ConstrainedZonotope, SetError> {
        mean_value(f, x, hull, w, self.0, lp)
    }
}

struct FirstOrder<'a>(&'a CzfoSettings);

impl Extension for FirstOrder<'_> {
    fn of<F: Function>(
        &self,
        f: &F,
        x: &ConstrainedZonotope,
        hull: &IntervalVector,
        w: &ConstrainedZonotope,
        lp: &mut LinearProgram,
    ) -> Result<ConstrainedZonotope, SetError> {
        let CzfoSettings {
            h,
            expansion,
            remainder,
            ..
        } = *self.0;
        first_order(f, x, hull, w, h, remainder, expansion, lp)
    }
}

/// What both filters share.
#[derive(Clone, Debug)]
struct ConstrainedFilter<Y> {
    model: Model<Y>,
    generators: usize,
    constraints: usize,
    units: Units,
    passes: usize,
}

impl<Y: System> ConstrainedFilter<Y> {
    fn new(
        kind: &'static str,
        generators: usize,
        constraints: usize,
        scale: Scale,
        measurement: &MeasurementSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        let model = Model::new(kind, problem)?;
        let n = model.prior.dim();
        if generators < n + constraints {
            let expected = format!("at least n + constraints = {}", n + constraints);
            return Err(EstimationError::setting(
                kind,
                "generators",
                expected,
                generators,
            ));
        }
        Ok(Self {
            model,
            generators,
            constraints,
            units: scale.units(&problem.prior),
            passes: measurement.passes(kind)?,
        })
    }

    fn prior(&self) -> ConstrainedBelief {
        ConstrainedBelief::new(self.model.prior.clone(), Default::default())
    }

    fn reduce(&self, set: ConstrainedZonotope) -> Result<ConstrainedZonotope, SetError> {
        let reduce = |set: &_| scott::reduce(set, self.generators, self.constraints);
        self.units.constrained(&set.fold(), reduce)
    }

    /// `extension` of the belief's set, its hull and f, all in the filter's units.
    fn predict(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
        extension: impl Extension,
    ) -> Result<ConstrainedBelief, EstimationError> {
        let f = self.model.dynamics(before(k)?, u)?;
        let mut lp = LinearProgram::new();
        let hull = belief
            .hull()
            .map_err(EstimationError::at(k, "interval hull"))?;
        let (set, w) = (&belief.set, &self.model.w);
        let moved = match self.units.as_slice() {
            None => extension.of(&f, set, &hull, w, &mut lp),
            Some(units) => self.units.constrained(set, |set| {
                let f = InUnits { f: &f, units };
                extension.of(&f, set, &divided_box(&hull, units), w, &mut lp)
            }),
        };
        Ok(ConstrainedBelief::new(
            moved.map_err(EstimationError::at(k, "prediction"))?,
            lp.work(),
        ))
    }

    /// X ∩_C (y − D_v V), then the reduction, then the hull that the next prediction needs.
    fn update(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ConstrainedBelief, EstimationError> {
        let mut lp = LinearProgram::new();
        let mut set = belief.set.clone();
        let (mut cut, mut left_out) = (false, List::new());
        for pass in 0..self.passes {
            let hull = || {
                let hull = match pass {
                    0 => belief.hull(),
                    _ => set.interval_hull_with(&mut lp),
                };
                hull.map_err(EstimationError::at(k, "interval hull"))
            };
            let Some(reading) = self.model.read(k, u, y, hull)? else {
                break;
            };
            left_out = reading.left_out;
            let Some((c, target)) = reading.strips else {
                break;
            };
            let joined = set.generalized_intersection(&c, &target);
            set = joined.map_err(EstimationError::at(k, "update"))?;
            cut = true;
            if reading.exact {
                break;
            }
        }
        // Where nothing was read, only what has grown is reduced.
        if cut || set.generators() > self.generators || set.constraints() > self.constraints {
            set = self
                .reduce(set)
                .map_err(EstimationError::at(k, "reduction"))?;
        }
        ConstrainedBelief::with_hull(set, left_out, &mut lp)
            .map_err(EstimationError::at(k, "interval hull"))
    }
}

/// The constrained zonotope filter by the mean value extension ([`mean_value`]).
///
/// predict: the extension of Theorem 2; update: X ∩_C (y − D u − D_v V), exact where the measurement is linear, and by
/// its mean value form where it is not; then constraints are
/// eliminated and generators reduced (Scott; Method 4), in `update`, because the paper reports the reduced set.
///
/// Guaranteed: x_k lies in every set if the assumptions hold, for whatever h.
///
/// Source: [Rego2020, Secs. 4.1 and 5].
#[derive(Clone, Debug)]
pub struct Czmv<Y = AnySystem> {
    filter: ConstrainedFilter<Y>,
    h: Choice,
}

impl<Y: System> Czmv<Y> {
    /// Fails where a part of the problem has no set, `generators` is below n + `constraints`, or a setting is out of
    /// range.
    pub fn new(settings: &CzmvSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        let CzmvSettings {
            generators,
            constraints,
            scale,
            ref measurement,
            ..
        } = *settings;
        let filter =
            ConstrainedFilter::new("czmv", generators, constraints, scale, measurement, problem)?;
        Ok(Self {
            filter,
            h: settings.h,
        })
    }
}

impl<Y: System> Estimator for Czmv<Y> {
    type Belief = ConstrainedBelief;
    fn prior(&self) -> ConstrainedBelief {
        self.filter.prior()
    }
    fn predict(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
    ) -> Result<ConstrainedBelief, EstimationError> {
        self.filter.predict(k, belief, u, MeanValue(self.h))
    }
    /// Takes in y_k and reduces: the paper reports the reduced set.
    fn update(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ConstrainedBelief, EstimationError> {
        self.filter.update(k, belief, u, y)
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

/// The constrained zonotope filter by the first-order Taylor extension ([`first_order`]).
///
/// As [`Czmv`] with the extension of Theorem 3. Guaranteed with [`Remainder::Symmetric`]; the printed
/// remainder is false where h is not the center.
///
/// Source: [Rego2020, Secs. 4.2 and 5].
#[derive(Clone, Debug)]
pub struct Czfo<Y = AnySystem> {
    filter: ConstrainedFilter<Y>,
    settings: CzfoSettings,
}

impl<Y: System> Czfo<Y> {
    /// Fails as [`Czmv::new`].
    pub fn new(settings: &CzfoSettings, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        let CzfoSettings {
            generators,
            constraints,
            scale,
            ref measurement,
            ..
        } = *settings;
        let filter =
            ConstrainedFilter::new("czfo", generators, constraints, scale, measurement, problem)?;
        Ok(Self {
            filter,
            settings: settings.clone(),
        })
    }
}

impl<Y: System> Estimator for Czfo<Y> {
    type Belief = ConstrainedBelief;
    fn prior(&self) -> ConstrainedBelief {
        self.filter.prior()
    }
    fn predict(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
    ) -> Result<ConstrainedBelief, EstimationError> {
        self.filter
            .predict(k, belief, u, FirstOrder(&self.settings))
    }
    /// Takes in y_k and reduces: the paper reports the reduced set.
    fn update(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ConstrainedBelief, EstimationError> {
        self.filter.update(k, belief, u, y)
    }
    fn guaranteed(&self) -> bool {
        self.settings.remainder == Remainder::Symmetric
    }
    fn reads(&self) -> &'static str {
        "y_0 ... y_{k-1} (predicted), y_0 ... y_k (updated)"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
}
