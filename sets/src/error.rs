//! The one error type of this crate.

/// What can go wrong in an operation on sets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// Shapes do not fit.
    #[error("{op}: expected dimension {expected}, got {got}")]
    Dimension {
        /// The operation.
        op: &'static str,
        /// What was expected.
        expected: usize,
        /// What came.
        got: usize,
    },
    /// A coefficient is NaN or infinite.
    #[error("{op}: expected finite numbers, got {value}")]
    NotFinite {
        /// The operation.
        op: &'static str,
        /// The offending value.
        value: f64,
    },
    /// A lower bound lies above its upper bound.
    #[error("{op}: expected lower <= upper, got [{lower}, {upper}] in component {index}")]
    Reversed {
        /// The operation.
        op: &'static str,
        /// The component.
        index: usize,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// The intersection is empty: a result of the mathematics, not a failure.
    #[error("{op}: the intersection is empty")]
    Empty {
        /// The operation.
        op: &'static str,
    },
    /// A function is evaluated outside its domain (division by an interval containing 0, …).
    #[error("{op}: the argument [{lower}, {upper}] leaves the domain")]
    Domain {
        /// The operation.
        op: &'static str,
        /// The argument's lower bound.
        lower: f64,
        /// The argument's upper bound.
        upper: f64,
    },
    /// A matrix that must be inverted or factored is singular (or not positive definite).
    #[error("{op}: the matrix is singular or not positive definite")]
    Singular {
        /// The operation.
        op: &'static str,
    },
    /// A number of generators, an order or a level is out of its range.
    #[error("{op}: {what} must be {expected}, got {got}")]
    Range {
        /// The operation.
        op: &'static str,
        /// Which parameter.
        what: &'static str,
        /// The allowed range.
        expected: &'static str,
        /// What came.
        got: f64,
    },
}
