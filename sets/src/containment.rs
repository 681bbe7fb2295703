//! The three answers to "does this set contain that point?".

/// What is known about a point and a set when every rounding is accounted for.
///
/// The point is given as a box that holds it. `Inside` and `Outside` are theorems; whoever needs a
/// yes or a no treats `Undecided` as "not refuted".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Containment {
    /// Every point of the box lies in the set.
    Inside,
    /// No point of the box lies in the set.
    Outside,
    /// Neither could be shown.
    Undecided,
}
