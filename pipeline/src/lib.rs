//! zonobench

pub mod svg;
pub mod trace;
