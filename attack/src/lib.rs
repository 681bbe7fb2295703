//! The campaign against the guarantees: estimators and hulls that are called guaranteed, data made to
//! break them, and the count of how often they did.
//!
//! Every [`Target`] is run against every [`Attack`]: the noise keeps to the bounds that the estimator is
//! told, and is otherwise as bad as we can make it. The true state is an interval that encloses the exact
//! trajectory of the noise that was drawn; a step is *lost* only where the whole interval is certainly
//! outside the set, or where the estimator says that its set is empty. Targets that are not guaranteed
//! are attacked too, to show that the attacks can break something.
//!
//! Draws are addressed by (target, attack, run): no count depends on the others, on their order or on
//! the number of threads.

mod adversary;
mod bits;
mod campaign;
mod cases;
pub mod hulls;
mod rate;
mod strips;
mod targets;

pub use adversary::Attack;
pub use bits::bits;
pub use campaign::{Counts, attack, attack_on, attack_own};
pub use cases::{Case, cases};
pub use rate::clopper_pearson_upper;
pub use strips::{MARGINS, near_empty};
pub use targets::{Own, TARGETS, Target};
