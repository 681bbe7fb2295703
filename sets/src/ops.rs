//! The tally of operations: counts of work really done, fed by `matrix` and the reductions.
//!
//! Multiplications and additions are counted only with the feature `tally`; without it `count`
//! compiles to nothing.

/// Adds `multiplications` and `additions` to this thread's tally.
#[inline(always)]
pub fn count(multiplications: usize, additions: usize) {
    let _ = (multiplications, additions);
}
