//! Which results are needed, in which order, what is published of them, and how far the work is.

pub mod campaign;
pub mod code;
pub mod engine;
mod graph;
pub mod long_campaign;
mod parts;
pub mod progress;
mod publish;
mod times;
