//! What is found apart from experiments: the papers' numbered claims, counts of operations, attacks on the guarantees.

pub mod attack;
pub mod claims;
pub mod count;
pub mod ledger;

/// The crate that these stages are in: its sources, and those of all that it stands on, are part of their results'
/// addresses.
pub const CRATE: &str = env!("CARGO_PKG_NAME");
