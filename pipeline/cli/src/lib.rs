//! The program `zonobench`.

pub mod cli;
