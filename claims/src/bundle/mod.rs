//! The claims of \[Khajenejad\]: bundles and constrained zonotopes by remainder-form decomposition functions.

mod decomposition;
mod lemmas;
mod polytopes;

use crate::{Claim, Class};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    [
        polytopes::claims(),
        decomposition::claims(),
        lemmas::claims(),
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
        paper: "bundle",
        id,
        statement,
        consequence,
        class: Class::Stated,
        run,
        twins: Vec::new(),
    }
}
