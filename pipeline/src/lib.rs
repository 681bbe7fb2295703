//! zonobench

pub mod trace;
