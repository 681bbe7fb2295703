//! Recursive estimators: what is known goes in and comes out.
//!
//! An estimator turns a belief about x_{k−1} into one about x_k (`predict`), takes a measurement in
//! (`update`), and makes the result simpler where it has grown (`reduce_order`). It never sees the
//! truth. The estimators are a closed family, [`AnyEstimator`]: one file each under `estimators/`,
//! one line each below.

use crate::estimators::{
    BoxStateEst, BoxStateEstSettings, BoxWindow, Comb, CombPlus, ConstrainedBelief, Czfo,
    CzfoSettings, Czmv, CzmvSettings, DCz, DRrsr, DZb, Ekf, EkfSettings, Ezgkf, EzgkfM,
    EzgkfSettings, Ezgkp, EzgkpSettings, Gaussian, Inzsmf, Kalman, KalmanSettings, Lift,
    MixedBelief, Particle, ParticleBelief, ParticleSettings, PolytopeBelief,
    PolytopeFilterSettings, PoseZonotope, Rrsr, Ukf, UkfSettings, VehicleFilterSettings, Zfo, Zmv,
    ZonotopeBelief, ZonotopeFilterSettings, Zsmf,
};
use crate::reported::Reported;
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use zonobench_sets::{Interval, IntervalVector, Matrix};

pub use zonobench_sets::Containment;

/// One measurement y_k; None where that component was not measured at this k.
pub type Measurement<'a> = &'a [Option<f64>];

/// Which of the two beliefs of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// After `predict`, before y_k.
    Predicted,
    /// After `update`.
    Updated,
}

/// How large a belief is; None where a quantity is not defined or not asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
    /// p, the number of generators.
    pub n_generators: Option<usize>,
    /// q, the number of constraints.
    pub n_constraints: Option<usize>,
    /// tr(G Gᵀ), a sum over components, which depends on their units.
    pub trace_ggt: Option<f64>,
    /// The largest half-width of the interval hull, whatever the units of the components.
    pub radius: Option<f64>,
    /// The volume, up to three dimensions.
    pub volume: Option<f64>,
    /// Linear programs solved to make it.
    pub lp_count: usize,
    /// Pivots of those programs.
    pub pivots: usize,
    /// Those programs in which the simplex gave up before its optimum.
    pub unfinished: usize,
    /// Those that were given to the interior-point solver besides, whose bits may depend on the processor.
    pub fallbacks: usize,
}

/// A number that one kind of belief has and others have not: its name, unique within the kind, and its
/// value.
pub type Extra = (&'static str, f64);

/// The pieces a set is drawn from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// "box", "zonotope", "gaussian", "zonotopic-gaussian", …
    pub kind: &'static str,
    /// c. Of a constrained zonotope it is the center of the generators, which may lie outside the set.
    pub center: Vec<f64>,
    /// G, n × p.
    pub generators: Option<Matrix>,
    /// A and b of a constrained zonotope.
    pub constraints: Option<(Matrix, Vec<f64>)>,
    /// P, n × n.
    pub covariance: Option<Matrix>,
    /// The lower and upper bounds of a box, or of the confidence box.
    pub bounds: Option<IntervalVector>,
}

/// What is known of x_k.
///
/// Laws: `center` has n entries, all finite; `interval_hull` contains it; `contains` never calls
/// `Outside` what the hull wholly contains only because of rounding.
pub trait Belief: Clone + Send {
    /// The point estimate.
    fn center(&self) -> Vec<f64>;
    /// The smallest box around the set (rounded outward where the estimator is guaranteed); for a mixed
    /// belief the confidence box. None where the belief has no set.
    fn interval_hull(&self) -> Option<IntervalVector>;
    /// Whether the true state, known to lie in the box `x`, is in the set.
    fn contains(&self, x: &[Interval]) -> Containment;
    /// The covariance of the Gaussian part.
    fn covariance(&self) -> Option<&Matrix>;
    /// How large it is.
    fn size(&self) -> Size;
    /// Its volume, in the product of the components' units: that of [`Belief::size`] unless it takes more
    /// than the step itself, and is then computed here, for those who ask. None where it is not known.
    fn volume(&self) -> Option<f64> {
        self.size().volume
    }
    /// The components of y_k that were measured and that the update could not use, so that they are not in this set: h or a
    /// derivative of it may be undefined somewhere in the predicted one. None unless the documentation names some.
    fn left_out(&self) -> &[usize] {
        &[]
    }
    /// What it is drawn from.
    fn shape(&self) -> Shape;
    /// What metrics may ask of this kind of belief beyond hull, size and covariance; none unless its
    /// documentation names some. The same names, in the same order, at every step.
    fn extras(&self) -> Vec<Extra> {
        Vec::new()
    }
    /// What its rows say in place of `ok` though the run goes on: `singular` where the measurement was not taken in.
    fn status(&self) -> Option<&'static str> {
        None
    }
    /// True if both are known to say the same of the state: an estimator that only keeps y_k for its next
    /// prediction has the same belief before and after. False where that is not looked at.
    fn says_the_same(&self, other: &Self) -> bool {
        let _ = other;
        false
    }
}

/// A recursive estimator.
///
/// Laws: `prior` and every result have the system's number of states; the same arguments give the same
/// bits; `reduce_order` contains its argument; a measurement that contradicts a guaranteed set is
/// [`EstimationError::Inconsistent`].
pub trait Estimator: Send + Sync {
    /// What is carried from step to step.
    type Belief: Belief;
    /// What is known of x_0 before anything is measured.
    fn prior(&self) -> Self::Belief;
    /// The same for one of several runs: an estimator that draws random numbers draws others in each.
    fn prior_of_run(&self, run: u64) -> Self::Belief {
        let _ = run;
        self.prior()
    }
    /// From the (updated, reduced) belief at k − 1 to the predicted one at `k`, which is 1 or more; `u_prev` is u_{k−1}.
    fn predict(
        &self,
        k: usize,
        belief: &Self::Belief,
        u_prev: &[f64],
    ) -> Result<Self::Belief, EstimationError>;
    /// Takes in y_k, with the input u_k that the measurement equation may hold.
    fn update(
        &self,
        k: usize,
        belief: &Self::Belief,
        u: &[f64],
        y: Measurement,
    ) -> Result<Self::Belief, EstimationError>;
    /// A simpler belief that contains this one, for the next prediction.
    fn reduce_order(
        &self,
        k: usize,
        belief: Self::Belief,
    ) -> Result<Self::Belief, EstimationError> {
        let _ = k;
        Ok(belief)
    }
    /// True if its set is proved to contain the state whenever the problem's assumptions hold.
    fn guaranteed(&self) -> bool;
    /// The measurements that the belief reported at k has read.
    fn reads(&self) -> &'static str;
    /// Which phase its paper reports.
    fn reported_phase(&self) -> Phase;
    /// False if the paper starts with y_1; then `update` is not called at k = 0.
    fn uses_first_measurement(&self) -> bool {
        true
    }
    /// What a user should know before trusting the numbers, e.g. an ill-conditioned inversion.
    fn warning(&self) -> Option<String> {
        None
    }
    /// What it took from the problem where its settings do not say, as key and value; none unless its documentation
    /// names some.
    fn readings(&self) -> Vec<(&'static str, &'static str)> {
        Vec::new()
    }
}

/// What stands in a file about one kind of estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindInfo {
    /// The value of `kind`.
    pub kind: &'static str,
    /// Its settings.
    pub keys: &'static [&'static str],
}

macro_rules! beliefs {
    ($($belief:ident),+ $(,)?) => {
        /// The belief of any estimator.
        #[derive(Clone, Debug)]
        pub enum AnyBelief {
            $(#[doc = concat!("[`", stringify!($belief), "`]")] $belief($belief)),+
        }

        impl Belief for AnyBelief {
            fn center(&self) -> Vec<f64> {
                match self { $(Self::$belief(b) => b.center()),+ }
            }
            fn interval_hull(&self) -> Option<IntervalVector> {
                match self { $(Self::$belief(b) => b.interval_hull()),+ }
            }
            fn contains(&self, x: &[Interval]) -> Containment {
                match self { $(Self::$belief(b) => b.contains(x)),+ }
            }
            fn covariance(&self) -> Option<&Matrix> {
                match self { $(Self::$belief(b) => b.covariance()),+ }
            }
            fn size(&self) -> Size {
                match self { $(Self::$belief(b) => b.size()),+ }
            }
            fn volume(&self) -> Option<f64> {
                match self { $(Self::$belief(b) => b.volume()),+ }
            }
            fn left_out(&self) -> &[usize] {
                match self { $(Self::$belief(b) => b.left_out()),+ }
            }
            fn shape(&self) -> Shape {
                match self { $(Self::$belief(b) => b.shape()),+ }
            }
            fn extras(&self) -> Vec<Extra> {
                match self { $(Self::$belief(b) => b.extras()),+ }
            }
            fn status(&self) -> Option<&'static str> {
                match self { $(Self::$belief(b) => b.status()),+ }
            }
            fn says_the_same(&self, other: &Self) -> bool {
                match (self, other) {
                    $((Self::$belief(a), Self::$belief(b)) => a.says_the_same(b),)+
                    _ => false,
                }
            }
        }
    };
}

macro_rules! estimators {
    ($($estimator:ident, $settings:ident, $belief:ident, $kind:literal, $keys:expr;)+) => {
        /// The settings of any estimator, as they stand in a file: `kind` and that kind's keys.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind")]
        pub enum EstimatorSettings {
            $(
                #[doc = concat!("`", $kind, "`")]
                #[serde(rename = $kind)]
                $estimator($settings)
            ),+
        }

        impl EstimatorSettings {
            /// The value of `kind`.
            pub fn kind(&self) -> &'static str {
                match self { $(Self::$estimator(_) => $kind),+ }
            }
        }

        /// Every kind of estimator and its keys.
        pub const KINDS: &[KindInfo] = &[$(KindInfo { kind: $kind, keys: &$keys }),+];

        /// Any estimator.
        #[derive(Clone, Debug)]
        pub enum AnyEstimator {
            $(#[doc = concat!("[`", stringify!($estimator), "`]")] $estimator($estimator)),+
        }

        impl AnyEstimator {
            /// The estimator with these settings for `problem`, everything checked.
            ///
            /// Fails where the problem is not valid, a setting is out of range, or the problem lacks
            /// what this kind needs; the error names the key.
            pub fn new(
                settings: &EstimatorSettings,
                problem: &Problem,
            ) -> Result<Self, EstimationError> {
                match settings {
                    $(EstimatorSettings::$estimator(s) => {
                        Ok(Self::$estimator($estimator::new(s, problem)?))
                    })+
                }
            }

            /// The value of `kind` in a file.
            pub fn kind(&self) -> &'static str {
                match self { $(Self::$estimator(_) => $kind),+ }
            }

            fn foreign(&self) -> EstimationError {
                EstimationError::Unsupported {
                    kind: self.kind(),
                    what: "a belief of another estimator",
                    reason: "a belief holds what its own estimator carries from step to step".into(),
                }
            }
        }

        impl Estimator for AnyEstimator {
            type Belief = AnyBelief;
            fn prior(&self) -> AnyBelief {
                match self { $(Self::$estimator(e) => AnyBelief::$belief(e.prior())),+ }
            }
            fn prior_of_run(&self, run: u64) -> AnyBelief {
                match self { $(Self::$estimator(e) => AnyBelief::$belief(e.prior_of_run(run))),+ }
            }
            fn predict(
                &self,
                k: usize,
                belief: &AnyBelief,
                u_prev: &[f64],
            ) -> Result<AnyBelief, EstimationError> {
                match (self, belief) {
                    $((Self::$estimator(e), AnyBelief::$belief(b)) => {
                        e.predict(k, b, u_prev).map(AnyBelief::$belief)
                    })+
                    _ => Err(self.foreign()),
                }
            }
            fn update(
                &self,
                k: usize,
                belief: &AnyBelief,
                u: &[f64],
                y: Measurement,
            ) -> Result<AnyBelief, EstimationError> {
                match (self, belief) {
                    $((Self::$estimator(e), AnyBelief::$belief(b)) => {
                        e.update(k, b, u, y).map(AnyBelief::$belief)
                    })+
                    _ => Err(self.foreign()),
                }
            }
            fn reduce_order(
                &self,
                k: usize,
                belief: AnyBelief,
            ) -> Result<AnyBelief, EstimationError> {
                match (self, belief) {
                    $((Self::$estimator(e), AnyBelief::$belief(b)) => {
                        e.reduce_order(k, b).map(AnyBelief::$belief)
                    })+
                    _ => Err(self.foreign()),
                }
            }
            fn guaranteed(&self) -> bool {
                match self { $(Self::$estimator(e) => e.guaranteed()),+ }
            }
            fn reads(&self) -> &'static str {
                match self { $(Self::$estimator(e) => e.reads()),+ }
            }
            fn reported_phase(&self) -> Phase {
                match self { $(Self::$estimator(e) => e.reported_phase()),+ }
            }
            fn uses_first_measurement(&self) -> bool {
                match self { $(Self::$estimator(e) => e.uses_first_measurement()),+ }
            }
            fn warning(&self) -> Option<String> {
                match self { $(Self::$estimator(e) => e.warning()),+ }
            }
            fn readings(&self) -> Vec<(&'static str, &'static str)> {
                match self { $(Self::$estimator(e) => e.readings()),+ }
            }
        }
    };
}

beliefs!(
    Gaussian,
    ParticleBelief,
    BoxWindow,
    MixedBelief,
    ZonotopeBelief,
    ConstrainedBelief,
    PoseZonotope,
    PolytopeBelief,
    Reported,
);

const VEHICLE_KEYS: [&str; 8] = [
    "generators",
    "gain",
    "reduction",
    "transition",
    "transient",
    "remainder",
    "side",
    "scale",
];

const POLYTOPE_KEYS: [&str; 5] = ["vectors", "choose", "jacobian", "start", "facets"];

const MIXED_KEYS: [&str; 7] = [
    "phi",
    "eta",
    "alpha",
    "gain",
    "overbars",
    "merge_parallel",
    "scale",
];

estimators! {
    Kalman, KalmanSettings, Gaussian, "kalman", [];
    Ekf, EkfSettings, Gaussian, "ekf", ["wrap"];
    Ukf, UkfSettings, Gaussian, "ukf", ["alpha", "beta", "kappa", "wrap"];
    Particle, ParticleSettings, ParticleBelief, "particle",
        ["particles", "resample_below", "seed", "wrap"];
    BoxStateEst, BoxStateEstSettings, BoxWindow, "box-state-est", ["products", "scale"];
    Ezgkf, EzgkfSettings, MixedBelief, "ezgkf", MIXED_KEYS;
    EzgkfM, EzgkfSettings, MixedBelief, "ezgkf-m", MIXED_KEYS;
    Ezgkp, EzgkpSettings, MixedBelief, "ezgkp",
        ["phi", "eta", "alpha", "gain", "overbars", "merge_parallel", "form", "scale"];
    Zmv, ZonotopeFilterSettings, ZonotopeBelief, "zmv", ["generators", "scale", "measurement"];
    Zfo, ZonotopeFilterSettings, ZonotopeBelief, "zfo", ["generators", "scale", "measurement"];
    Czmv, CzmvSettings, ConstrainedBelief, "czmv",
        ["generators", "constraints", "h", "scale", "measurement"];
    Czfo, CzfoSettings, ConstrainedBelief, "czfo",
        ["generators", "constraints", "h", "expansion", "remainder", "scale", "measurement"];
    Zsmf, VehicleFilterSettings, PoseZonotope, "zsmf", VEHICLE_KEYS;
    Inzsmf, VehicleFilterSettings, PoseZonotope, "inzsmf", VEHICLE_KEYS;
    Rrsr, PolytopeFilterSettings, PolytopeBelief, "rrsr", POLYTOPE_KEYS;
    DRrsr, PolytopeFilterSettings, PolytopeBelief, "d-rrsr", POLYTOPE_KEYS;
    DZb, PolytopeFilterSettings, PolytopeBelief, "d-zb", POLYTOPE_KEYS;
    DCz, PolytopeFilterSettings, PolytopeBelief, "d-cz", POLYTOPE_KEYS;
    Comb, PolytopeFilterSettings, PolytopeBelief, "comb", POLYTOPE_KEYS;
    CombPlus, PolytopeFilterSettings, PolytopeBelief, "comb+", POLYTOPE_KEYS;
    Lift, PolytopeFilterSettings, PolytopeBelief, "lift",
        ["vectors", "choose", "jacobian", "start", "facets", "carry"];
}

/// Whether a state in the box `x` lies in the box `hull`.
pub(crate) fn box_contains(hull: &IntervalVector, x: &[Interval]) -> Containment {
    if hull
        .iter()
        .zip(x)
        .any(|(side, x)| side.intersect(x).is_none())
    {
        Containment::Outside
    } else if hull
        .iter()
        .zip(x)
        .all(|(side, x)| side.contains_interval(*x))
    {
        Containment::Inside
    } else {
        Containment::Undecided
    }
}
