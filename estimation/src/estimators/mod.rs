//! The estimators, one a file: settings, struct, impl.

mod box_state_est;
mod bundle;
mod czmv;
mod ekf;
mod ezgkf;
mod ezgkf_m;
mod ezgkp;
mod innovation;
mod inzsmf;
mod inzsmf_enclosed;
mod kalman;
mod linear_output;
mod measurement;
mod mixed;
mod moments;
mod particle;
mod pose_zonotope;
mod scale;
mod set_membership;
mod ukf;
mod vehicle_filter;
mod width_bound;
mod zmv;
mod zsmf;

pub use box_state_est::{BoxStateEst, BoxStateEstSettings, BoxWindow, CONDITION_WARNING, Products};
pub use bundle::{
    Carry, Comb, CombPlus, DCz, DRrsr, DZb, Lift, PolytopeBelief, PolytopeFilterSettings, Rrsr,
    Start,
};
pub use czmv::{Czfo, CzfoSettings, Czmv, CzmvSettings};
pub use ekf::{Ekf, EkfSettings};
pub use ezgkf::{Ezgkf, EzgkfSettings};
pub use ezgkf_m::EzgkfM;
pub use ezgkp::{Ezgkp, EzgkpSettings, Form};
pub use inzsmf::Inzsmf;
pub use inzsmf_enclosed::Enclosed;
pub use kalman::{Gaussian, Innovated, Kalman, KalmanSettings};
pub use measurement::MeasurementSettings;
pub use mixed::{Gain, MixedBelief, covariance_bound};
pub use particle::{Particle, ParticleBelief, ParticleSettings};
pub use pose_zonotope::{Coordinates, PoseZonotope};
pub use scale::Scale;
pub use set_membership::{ConstrainedBelief, ZonotopeBelief};
pub use ukf::{Ukf, UkfSettings};
pub use vehicle_filter::{
    Poles, PoseGain, PoseReduction, Remainder, Side, Transient, Transition, VehicleFilterSettings,
    f_radius_gain, pole_gain, reduce_as_printed, reduce_without_absolute_values,
};
pub use width_bound::{WidthBound, printed_width_bound, width_bound};
pub use zmv::{Zfo, Zmv, ZonotopeFilterSettings};
pub use zsmf::Zsmf;
