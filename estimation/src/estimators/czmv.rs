//! CZMV and CZFO: constrained zonotopes through the mean value or the first-order Taylor extension, with
//! exact intersections.

use super::set_membership::{ConstrainedBelief, Model};
use crate::estimator::{Estimator, Measurement, Phase};
use crate::propagation::{Choice, Expansion, Remainder, first_order, mean_value};
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::scott;

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
}

fn c4() -> Choice {
    Choice::C4
}

/// What both filters share.
#[derive(Clone, Debug)]
struct ConstrainedFilter {
    model: Model,
    generators: usize,
    constraints: usize,
}

impl ConstrainedFilter {
    fn new(
        kind: &'static str,
        generators: usize,
        constraints: usize,
        problem: &Problem,
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
        })
    }

    fn prior(&self) -> ConstrainedBelief {
        ConstrainedBelief::new(self.model.prior.clone(), Default::default())
    }

    /// X ∩_C (y − D_v V), then the reduction, then the hull that the next prediction needs.
    fn update(
        &self,
        k: usize,
        belief: &ConstrainedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ConstrainedBelief, EstimationError> {
        let set = match self.model.observe(k, u, y)? {
            Some((c, target)) => {
                let joined = belief.set.generalized_intersection(&c, &target);
                scott::reduce(
                    &joined.map_err(EstimationError::at(k, "update"))?.fold(),
                    self.generators,
                    self.constraints,
                )
            }
            // Nothing measured: only what has grown is reduced.
            None if belief.set.generators() <= self.generators
                && belief.set.constraints() <= self.constraints =>
            {
                Ok(belief.set.clone())
            }
            None => scott::reduce(
                &belief.set.clone().fold(),
                self.generators,
                self.constraints,
            ),
        };
        let set = set.map_err(EstimationError::at(k, "reduction"))?;
        ConstrainedBelief::with_hull(set, &mut LinearProgram::new())
            .map_err(EstimationError::at(k, "interval hull"))
    }
}

/// The constrained zonotope filter by the mean value extension ([`mean_value`]).
///
/// predict: the extension of Theorem 2; update: X ∩_C (y − D u − D_v V), exact; then constraints are
/// eliminated and generators reduced (Scott; Method 4), in `update`, because the paper reports the reduced set.
///
/// Guaranteed: x_k lies in every set if the assumptions hold, for whatever h.
///
/// Source: [Rego2020, Secs. 4.1 and 5].
#[derive(Clone, Debug)]
pub struct Czmv {
    filter: ConstrainedFilter,
    h: Choice,
}

impl Czmv {
    /// Fails where the measurement is not linear, a part of the problem has no set, or `generators` is
    /// below n + `constraints`.
    pub fn new(settings: &CzmvSettings, problem: &Problem) -> Result<Self, EstimationError> {
        let filter =
            ConstrainedFilter::new("czmv", settings.generators, settings.constraints, problem)?;
        Ok(Self {
            filter,
            h: settings.h,
        })
    }
}

impl Estimator for Czmv {
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
        let f = self.filter.model.dynamics(k - 1, u)?;
        let mut lp = LinearProgram::new();
        let hull = belief
            .hull()
            .map_err(EstimationError::at(k, "interval hull"))?;
        let set = mean_value(
            &f,
            &belief.set,
            &hull,
            &self.filter.model.w,
            self.h,
            &mut lp,
        );
        Ok(ConstrainedBelief::new(
            set.map_err(EstimationError::at(k, "prediction"))?,
            lp.work(),
        ))
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
pub struct Czfo {
    filter: ConstrainedFilter,
    settings: CzfoSettings,
}

impl Czfo {
    /// Fails as [`Czmv::new`].
    pub fn new(settings: &CzfoSettings, problem: &Problem) -> Result<Self, EstimationError> {
        let filter =
            ConstrainedFilter::new("czfo", settings.generators, settings.constraints, problem)?;
        Ok(Self {
            filter,
            settings: settings.clone(),
        })
    }
}

impl Estimator for Czfo {
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
        let f = self.filter.model.dynamics(k - 1, u)?;
        let mut lp = LinearProgram::new();
        let hull = belief
            .hull()
            .map_err(EstimationError::at(k, "interval hull"))?;
        let CzfoSettings {
            h,
            expansion,
            remainder,
            ..
        } = self.settings;
        let set = first_order(
            &f,
            &belief.set,
            &hull,
            &self.filter.model.w,
            h,
            remainder,
            expansion,
            &mut lp,
        );
        Ok(ConstrainedBelief::new(
            set.map_err(EstimationError::at(k, "prediction"))?,
            lp.work(),
        ))
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
