//! The one error type of this crate, and how it shows numbers.

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
    #[error("{op}: expected finite numbers, got {}", shortest(*.value))]
    NotFinite {
        /// The operation.
        op: &'static str,
        /// The offending value.
        value: f64,
    },
    /// A lower bound lies above its upper bound.
    #[error("{op}: expected lower <= upper, got [{}, {}] in component {index}", shortest(*.lower), shortest(*.upper))]
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
    #[error("{op}: the argument [{}, {}] leaves the domain", shortest(*.lower), shortest(*.upper))]
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
    #[error("{op}: {what} must be {expected}, got {}", shortest(*.got))]
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

/// `x` in as few digits as it needs, with an exponent where it is very small or very large.
pub fn shortest(x: f64) -> String {
    let size = x.abs();
    match size == 0.0 || !size.is_finite() || (1e-4..1e15).contains(&size) {
        true => format!("{x}"),
        false => format!("{x:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_size() {
        assert_eq!(shortest(-1e-8), "-1e-8");
        assert_eq!(shortest(0.0), "0");
        assert_eq!(shortest(-10.5), "-10.5");
        assert_eq!(shortest(2.5e300), "2.5e300");
        assert_eq!(shortest(f64::NAN), "NaN");
    }

    #[test]
    fn errors_show_very_small_and_very_large_numbers_with_an_exponent() {
        let domain = SetError::Domain {
            op: "ln",
            lower: -5e-324,
            upper: f64::MAX,
        };
        assert_eq!(
            domain.to_string(),
            "ln: the argument [-5e-324, 1.7976931348623157e308] leaves the domain"
        );
        let reversed = SetError::Reversed {
            op: "box",
            index: 1,
            lower: 1e-300,
            upper: -0.5,
        };
        assert_eq!(
            reversed.to_string(),
            "box: expected lower <= upper, got [1e-300, -0.5] in component 1"
        );
        let range = SetError::Range {
            op: "ellipsoid",
            what: "level",
            expected: "in (0, 1)",
            got: 1e-20,
        };
        assert_eq!(
            range.to_string(),
            "ellipsoid: level must be in (0, 1), got 1e-20"
        );
    }
}
