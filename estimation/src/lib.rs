//! zonobench
