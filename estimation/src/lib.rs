//! Systems and estimators: what is measured goes in, what is known of the state comes out.
//!
//! This crate knows no files, and no estimator here can see the truth: the simulator makes it, and
//! only the pipeline's judge holds it beside an estimator's beliefs.
//!
//! # What "guaranteed" means
//!
//! Where [`Estimator::guaranteed`] is true: if x_0 lies in the prior's set and every w_k, v_k in its set, if the
//! system is exactly this one with its f64 parameters, and if y_k and u_k are exactly the f64 numbers that came
//! in, then x_k lies in the set of every step k, in exact arithmetic; and [`EstimationError::Inconsistent`] is said only where one
//! of these assumptions is false. Every rounding of the estimator is carried outward. [`proof`] says why, step by
//! step, [`zonobench_sets::proof`] for the operations on sets, and what is not covered.

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compare with the platform's

mod admissible;
pub mod controller;
pub mod error;
pub mod estimator;
pub mod estimators;
pub mod growth;
pub mod linearised;
pub mod online;
pub mod outline;
pub mod problem;
#[doc = include_str!("proof.md")]
pub mod proof {}
pub mod propagation;
pub mod random;
pub mod reported;
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
pub use reported::Reported;
pub use simulate::{Inputs, Trajectory, Truth, simulate};
pub use system::{AnySystem, System};
pub use track::{Step, track};
/// The sets and the numbers, so that one dependency is enough.
pub use zonobench_sets as sets;
