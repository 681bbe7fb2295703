//! The program `zonobench`.

pub mod cli;
pub mod diff;
mod new;
