//! The systems, one a file.

pub mod equations;
mod linear;
mod lpv;
mod quadrotor;
mod raimondo;
mod unicycle;
mod van_der_pol;
pub(crate) mod vehicle_se2;

pub use equations::Equations;
pub use linear::Linear;
pub use lpv::Lpv;
pub use quadrotor::Quadrotor;
pub use raimondo::{Measured, QuotientForm, Raimondo};
pub use unicycle::Unicycle;
pub use van_der_pol::VanDerPol;
pub use vehicle_se2::{Form, VehicleSe2};
