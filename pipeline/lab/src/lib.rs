//! Where numbers are made: experiment files are read, runs are simulated, estimated, traced and reduced to metrics.
//!
//! What a paper prints, and how a number is shown, is not known here.

pub mod command;
pub mod experiment;
pub mod illustrate;
pub mod outlook;
pub mod recorded;
pub mod stage;
pub mod tracking;
