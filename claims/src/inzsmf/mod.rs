//! The claims of \[Li\]: zonotopes on SE(2) and the invariant filter.

mod filter;
mod group;

use crate::{Claim, Class};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    [group::claims(), filter::claims()].concat()
}

fn claim(
    id: &'static str,
    statement: &'static str,
    consequence: &'static str,
    run: fn(&mut crate::Trial),
) -> Claim {
    Claim {
        paper: "inzsmf",
        id,
        statement,
        consequence,
        class: Class::Stated,
        run,
        twins: Vec::new(),
    }
}
