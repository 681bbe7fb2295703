//! What the papers print, beside what was computed: scores over runs, cells, verdicts and their reasons.

pub mod compare;
pub mod judged;
pub mod papers;
pub mod published;
pub mod rank;
pub mod score;
pub mod statistics;
pub mod verdict;

/// The crate that these stages are in: its sources, and those of all that it stands on, are part of their results'
/// addresses.
pub const CRATE: &str = env!("CARGO_PKG_NAME");
