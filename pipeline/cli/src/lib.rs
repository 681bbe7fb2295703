//! The program `zonobench`.

pub mod cli;
mod new;
