//! The claims of \[dePaula\]: zonotopes and Gaussian vectors together, and the filter EZGKF.

mod filter;
mod forecast;
mod preliminaries;

pub use preliminaries::rotation;

use crate::{Claim, Class};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    [
        preliminaries::claims(),
        forecast::claims(),
        filter::claims(),
    ]
    .concat()
}

fn claim(
    id: &'static str,
    statement: &'static str,
    consequence: &'static str,
    run: fn(&mut crate::Trial),
) -> Claim {
    Claim {
        paper: "ezgkf",
        id,
        statement,
        consequence,
        class: Class::Stated,
        run,
        twins: Vec::new(),
    }
}
