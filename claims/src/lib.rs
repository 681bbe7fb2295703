//! The numbered claims of the five papers, put to the test.
//!
//! Each claim (theorem, proposition, lemma, corollary, remark, or a sentence that the method rests on) is a
//! [`Claim`]: what the paper says, and a function that tries it in exact rational arithmetic, on its smallest
//! known counterexample and on instances drawn by counter. Nothing here states a verdict: it is computed from
//! what the trials gave ([`Outcome::verdict`]).

// A matrix is read by its indices.
#![allow(clippy::needless_range_loop)]

pub mod exact;
mod trial;

mod box_;
mod bundle;
mod cz;
mod ezgkf;
mod inzsmf;

pub use trial::{Claim, Class, Outcome, Trial, Twin, Verdict};

/// The claims of every paper, in the order of the papers and of their text.
pub fn all() -> Vec<Claim> {
    [
        box_::claims(),
        bundle::claims(),
        cz::claims(),
        ezgkf::claims(),
        inzsmf::claims(),
    ]
    .concat()
}

/// The papers that have claims, in order.
pub const PAPERS: [&str; 5] = ["box", "bundle", "cz", "ezgkf", "inzsmf"];
