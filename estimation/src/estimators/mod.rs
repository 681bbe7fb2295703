//! The estimators, one a file: settings, struct, impl.

mod box_state_est;
mod czmv;
mod ezgkf;
mod ezgkf_m;
mod ezgkp;
mod kalman;
mod linear_output;
mod mixed;
mod set_membership;
mod width_bound;
mod zmv;

pub use box_state_est::{BoxStateEst, BoxStateEstSettings, BoxWindow, CONDITION_WARNING, Products};
pub use czmv::{Czfo, CzfoSettings, Czmv, CzmvSettings};
pub use ezgkf::{Ezgkf, EzgkfSettings};
pub use ezgkf_m::EzgkfM;
pub use ezgkp::{Ezgkp, EzgkpSettings, Form};
pub use kalman::{Gaussian, Kalman, KalmanSettings};
pub use mixed::{Gain, MixedBelief, covariance_bound};
pub use set_membership::{ConstrainedBelief, ZonotopeBelief};
pub use width_bound::{WidthBound, printed_width_bound, width_bound};
pub use zmv::{Zfo, Zmv, ZonotopeFilterSettings};
