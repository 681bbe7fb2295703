//! Systems and estimators: what is measured goes in, what is known of the state comes out.
//!
//! This crate knows no files, and no estimator here can see the truth: the simulator makes it, and
//! only the pipeline's judge holds it beside an estimator's beliefs.

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compare with the platform's

mod admissible;
pub mod controller;
pub mod error;
pub mod estimator;
pub mod estimators;
pub mod online;
pub mod outline;
pub mod problem;
pub mod propagation;
pub mod random;
pub mod signal;
pub mod simulate;
pub mod system;
pub mod systems;
pub mod track;
mod trajectory_error;

pub use error::EstimationError;
pub use estimator::{AnyBelief, AnyEstimator, Belief, Estimator, EstimatorSettings};
pub use online::Online;
pub use problem::{Problem, ProblemError, Uncertain, UncertainError};
pub use simulate::{Inputs, Trajectory, Truth, simulate};
pub use system::{AnySystem, System};
pub use track::{Step, track};
