//! The program `zonobench`.

pub mod cli;
pub mod diff;
