//! The papers' claims about cost, put to the test by counting what the code did.
//!
//! Each claim is a formula in sizes. The estimators, or the operations that they are made of, run on random
//! instances of many sizes with the tally of [`zonobench_sets::ops`] on, and what was counted is held
//! against the formula: their ratio, and how both grow with each size ([`fit`]). Counts beyond what can
//! be run come only from formulas that equal the tally at every size that was run ([`ezgkf::cost`], or the
//! polynomial through the counts).
//!
//! A statement O(·) cannot be refuted by a factor, only by growth: see [`claim::judge`].

pub mod claim;
pub mod cz;
pub mod ezgkf;
pub mod fit;
pub mod instance;
pub mod kalman;
pub mod sizes;

pub use claim::{Row, Verdict};

/// The papers that claim a cost, by the names of their folders.
pub const PAPERS: [&str; 3] = ["box", "cz", "ezgkf"];

/// All rows of a paper; none for a paper without such claims. The same at any number of threads.
pub fn count(paper: &str) -> Vec<Row> {
    match paper {
        "box" => kalman::rows(),
        "cz" => cz::rows(),
        "ezgkf" => ezgkf::rows(),
        _ => Vec::new(),
    }
}
