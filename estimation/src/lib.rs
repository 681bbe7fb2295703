//! Systems and estimators: what is measured goes in, what is known of the state comes out.
//!
//! This crate knows no files, and no estimator here can see the truth: the simulator makes it, and
//! only the pipeline's judge holds it beside an estimator's beliefs.

pub mod problem;

pub use problem::{Problem, ProblemError, Uncertain, UncertainError};
