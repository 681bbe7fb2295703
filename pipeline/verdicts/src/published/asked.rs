//! What a claim asks for: a comparison with a number, of the mean over the runs, of some run or of every run.

use std::fmt;

/// What must be true of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Comparison {
    /// `>= x`
    AtLeast(f64),
    /// `<= x`
    AtMost(f64),
    /// `> x`
    Above(f64),
    /// `< x`
    Below(f64),
    /// `== x`
    Equal(f64),
    /// `a..b`, both ends included
    Between(f64, f64),
}

/// The sign of a comparison with one number, and what makes it.
type Sign = (&'static str, fn(f64) -> Comparison);

impl Comparison {
    /// Parses `>=`, `<=`, `>`, `<`, `==` with a number, or `a..b`.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let simple: [Sign; 5] = [
            (">=", Self::AtLeast),
            ("<=", Self::AtMost),
            ("==", Self::Equal),
            (">", Self::Above),
            ("<", Self::Below),
        ];
        for (sign, make) in simple {
            if let Some(rest) = text.strip_prefix(sign) {
                return number(rest).map(make);
            }
        }
        let (a, b) = text.split_once("..")?;
        Some(Self::Between(number(a)?, number(b)?))
            .filter(|c| matches!(c, Self::Between(a, b) if a <= b))
    }

    /// Whether it is true of `x`.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Self::AtLeast(a) => x >= a,
            Self::AtMost(a) => x <= a,
            Self::Above(a) => x > a,
            Self::Below(a) => x < a,
            Self::Equal(a) => x == a,
            Self::Between(a, b) => a <= x && x <= b,
        }
    }

    /// Whether it is true of some number between `lo` and `hi`, and of all of them.
    pub fn of_interval(self, lo: f64, hi: f64) -> (bool, bool) {
        let some = match self {
            Self::AtLeast(a) => hi >= a,
            Self::AtMost(a) => lo <= a,
            Self::Above(a) => hi > a,
            Self::Below(a) => lo < a,
            Self::Equal(a) => lo <= a && a <= hi,
            Self::Between(a, b) => lo <= b && a <= hi,
        };
        // What is asked for is an interval: it holds all between two numbers that are in it.
        (some, self.holds(lo) && self.holds(hi))
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtLeast(a) => write!(f, ">={a}"),
            Self::AtMost(a) => write!(f, "<={a}"),
            Self::Above(a) => write!(f, ">{a}"),
            Self::Below(a) => write!(f, "<{a}"),
            Self::Equal(a) => write!(f, "=={a}"),
            Self::Between(a, b) => write!(f, "{a}..{b}"),
        }
    }
}

/// Of which of the runs a comparison must be true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantifier {
    /// Of their mean.
    Mean,
    /// Of at least one: existence.
    Some,
    /// Of each.
    Every,
}

/// What a claim asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Of which runs.
    pub quantifier: Quantifier,
    /// What.
    pub comparison: Comparison,
}

impl Asked {
    /// What [`Asked::parse`] reads, in words.
    pub const EXPECTED: &str = "a comparison (>=0.95, <=x, >x, <x, ==x or 0.4..0.6), alone or after `mean`, `some` or `every`";

    /// Parses a comparison, alone or after `mean`, `some` or `every`.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let (quantifier, rest) = match text.split_once(char::is_whitespace) {
            Some(("mean", rest)) => (Quantifier::Mean, rest),
            Some(("some", rest)) => (Quantifier::Some, rest),
            Some(("every", rest)) => (Quantifier::Every, rest),
            _ => (Quantifier::Mean, text),
        };
        Some(Self {
            quantifier,
            comparison: Comparison::parse(rest)?,
        })
    }
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.quantifier {
            Quantifier::Mean => write!(f, "{}", self.comparison),
            Quantifier::Some => write!(f, "some {}", self.comparison),
            Quantifier::Every => write!(f, "every {}", self.comparison),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comparisons_are_read_and_decided() {
        assert_eq!(
            Comparison::parse(">= 0.95"),
            Some(Comparison::AtLeast(0.95))
        );
        assert_eq!(
            Comparison::parse("0.4..0.6"),
            Some(Comparison::Between(0.4, 0.6))
        );
        assert_eq!(Comparison::parse("0.6..0.4"), None);
        assert_eq!(Comparison::parse("about 1"), None);
        assert!(
            Comparison::Equal(1.0).holds(1.0) && !Comparison::Equal(1.0).holds(1.0_f64.next_down())
        );
        assert!(!Comparison::Below(1.0).holds(1.0) && Comparison::Between(0.0, 1.0).holds(1.0));
    }

    #[test]
    fn an_interval_holds_both_outcomes_one_or_the_other() {
        let below = Comparison::Below(1.0);
        assert_eq!(below.of_interval(0.8, 0.9), (true, true));
        assert_eq!(below.of_interval(0.9, 1.0), (true, false));
        assert_eq!(below.of_interval(1.0, 1.1), (false, false));
        assert_eq!(Comparison::AtMost(1.0).of_interval(1.0, 1.1), (true, false));
        assert_eq!(Comparison::AtMost(1.0).of_interval(0.9, 1.0), (true, true));
        // Both ends outside, and the band within.
        assert_eq!(
            Comparison::Between(0.4, 0.6).of_interval(0.0, 1.0),
            (true, false)
        );
        assert_eq!(
            Comparison::Between(0.4, 0.6).of_interval(0.7, 1.0),
            (false, false)
        );
    }

    #[test]
    fn a_quantifier_stands_before_the_comparison() {
        for text in ["<1", "some >0.1", "every ==0", "0.4..0.6"] {
            assert_eq!(Asked::parse(text).unwrap().to_string(), text);
        }
        assert_eq!(Asked::parse("mean <1"), Asked::parse("<1"));
        for wrong in ["any <1", "some", "some about 1", "", "somewhat <1"] {
            assert_eq!(Asked::parse(wrong), None, "{wrong}");
        }
    }
}
