//! The claims of \[Rego2020\]: constrained zonotopes, the mean value and the first-order extension.

mod choices;
mod extensions;
mod sets;
mod taylor;

pub use extensions::{
    Damage, Intervals, eliminated, inclusion, inclusion_by, mean_value, slope_in,
};

use crate::{Claim, Class};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    [
        sets::claims(),
        extensions::claims(),
        taylor::claims(),
        choices::claims(),
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
        paper: "cz",
        id,
        statement,
        consequence,
        class: Class::Stated,
        run,
        twins: Vec::new(),
    }
}
