//! The verdicts: their names, the marks that they are seen by, what they mean, and how they are coloured.
//!
//! In the Parquet tables a verdict is its name; everywhere else it is this type.

use std::fmt;
use zonobench_lake::bad_input::{listed, nearest};

/// What came of a printed number, of a claim, or of a printed time. The order is that in which they are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// The same number.
    Exact,
    /// The same number to the digits that are printed.
    WithinRounding,
    /// A mean over random runs that a repetition of the paper's experiment could have given.
    WithinCi,
    /// Within a tolerance of this one number, which has its reason.
    WithinTolerance,
    /// A claim that is true.
    Holds,
    /// An equality of which the inequality is true.
    HoldsAsBound,
    /// The order of the printed times is that of ours.
    OrderingHolds,
    /// It agrees because something that the paper leaves open was chosen so.
    Fitted,
    /// It agrees, but by other things than the paper's.
    ByAccident,
    /// A claim about means, whose interval holds both outcomes.
    Undecided,
    /// A number that is another.
    Differs,
    /// A claim that is false.
    DoesNotHold,
    /// False as printed, and corrected by the paper's own proof or by an equation beside it.
    Slip,
    /// What would decide it is not printed.
    NotReproducible,
    /// Our text of the paper is damaged there.
    LostInSource,
    /// In the ledger: false as our damaged text has it.
    Damaged,
    /// In the ledger: a remark of ours, which the paper does not make.
    Remark,
    /// In the ledger: there was no trial.
    NotTested,
    /// There is no result.
    Error,
    /// A smoke run, compared with nothing.
    Quick,
}

/// How a verdict is coloured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// It came out.
    Good,
    /// It did not.
    Bad,
    /// It could not be decided.
    Open,
    /// Neither: it speaks of the text, or is not counted as a success.
    Plain,
    /// A fault of ours.
    Fault,
}

struct Facts {
    name: &'static str,
    mark: &'static str,
    tone: Tone,
    meaning: &'static str,
}

const fn facts(name: &'static str, mark: &'static str, tone: Tone, meaning: &'static str) -> Facts {
    Facts {
        name,
        mark,
        tone,
        meaning,
    }
}

impl Verdict {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 20] = [
        Self::Exact,
        Self::WithinRounding,
        Self::WithinCi,
        Self::WithinTolerance,
        Self::Holds,
        Self::HoldsAsBound,
        Self::OrderingHolds,
        Self::Fitted,
        Self::ByAccident,
        Self::Undecided,
        Self::Differs,
        Self::DoesNotHold,
        Self::Slip,
        Self::NotReproducible,
        Self::LostInSource,
        Self::Damaged,
        Self::Remark,
        Self::NotTested,
        Self::Error,
        Self::Quick,
    ];

    fn facts(self) -> Facts {
        match self {
            Self::Exact => facts("exact", "✓", Tone::Good, "the same number"),
            Self::WithinRounding => facts(
                "within_rounding",
                "✓",
                Tone::Good,
                "our number rounds to the printed one, or the printed one to ours",
            ),
            Self::WithinCi => facts(
                "within_ci",
                "✓",
                Tone::Good,
                "the printed number lies in the interval in which a mean of as many runs as the paper's lies with 99 % \
                 (the spread of both means, and half a unit of the last printed digit)",
            ),
            Self::WithinTolerance => facts(
                "within_tolerance",
                "✓",
                Tone::Good,
                "the two differ by no more than a tolerance of this one number, whose reason stands beside it",
            ),
            Self::Holds => facts(
                "holds",
                "✓",
                Tone::Good,
                "a claim in words, read as the comparison beside it, is true of our runs; a theorem of every trial",
            ),
            Self::HoldsAsBound => facts(
                "holds_as_bound",
                "✓",
                Tone::Good,
                "of an equality the inequality is true: a formula for a cost grows at least as fast as what was counted",
            ),
            Self::OrderingHolds => facts(
                "ordering_holds",
                "✓",
                Tone::Good,
                "a printed time has the same rank among its peers as ours, or what is said of it is true of ours; a \
                 time is never more than that",
            ),
            Self::Fitted => facts(
                "fitted",
                "=",
                Tone::Plain,
                "the two agree because something that the paper leaves open was chosen so; not counted as reproduced",
            ),
            Self::ByAccident => facts(
                "by_accident",
                "≈",
                Tone::Plain,
                "the two agree, but by other things than the paper's, as the reason says; not counted as reproduced",
            ),
            Self::Undecided => facts(
                "undecided",
                "?",
                Tone::Open,
                "a claim about means, whose 99 % interval over our runs holds both outcomes: more runs would decide it",
            ),
            Self::Differs => facts(
                "differs",
                "✗",
                Tone::Bad,
                "the printed number is outside the interval or the tolerance; the reason says what we think why",
            ),
            Self::DoesNotHold => facts(
                "does_not_hold",
                "✗",
                Tone::Bad,
                "a claim, under its own hypotheses and in the kindest reading of its words, is false of our runs or has a \
                 counterexample; the reason shows it",
            ),
            Self::Slip => facts(
                "slip",
                "✎",
                Tone::Plain,
                "a slip of the pen, which the paper's own proof or an equation beside it corrects; the reason says which",
            ),
            Self::NotReproducible => facts(
                "not_reproducible",
                "?",
                Tone::Open,
                "the paper does not print what would decide it; the reason gives the range that was seen",
            ),
            Self::LostInSource => facts(
                "lost_in_source",
                "–",
                Tone::Plain,
                "our text of the paper is damaged there, which is never charged to the authors; ours is shown",
            ),
            Self::Damaged => facts(
                "damaged",
                "–",
                Tone::Plain,
                "a claim that is false only as our damaged text has it",
            ),
            Self::Remark => facts(
                "remark",
                "·",
                Tone::Plain,
                "a remark of ours, which the paper does not make; outside of every count",
            ),
            Self::NotTested => facts("not_tested", "‼", Tone::Fault, "a claim without a trial"),
            Self::Error => facts(
                "error",
                "‼",
                Tone::Fault,
                "there is no result for the cell: a fault of ours",
            ),
            Self::Quick => facts(
                "quick",
                "·",
                Tone::Plain,
                "a smoke run with few runs and steps: compared with nothing",
            ),
        }
    }

    /// As in the lake.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// A sign beside the name, so that a table can be skimmed.
    pub fn mark(self) -> &'static str {
        self.facts().mark
    }

    /// Mark and name, on one line.
    pub fn shown(self) -> String {
        format!("{}\u{a0}{}", self.mark(), self.name())
    }

    /// In a sentence.
    pub fn meaning(self) -> &'static str {
        self.facts().meaning
    }

    /// How it is coloured.
    pub fn tone(self) -> Tone {
        self.facts().tone
    }

    /// Whether the paper's number or claim came out, by what the paper says alone.
    pub fn is_success(self) -> bool {
        self.tone() == Tone::Good
    }

    /// Whether a reader should look at it: it did not come out, or could not be decided.
    pub fn is_finding(self) -> bool {
        matches!(
            self,
            Self::Undecided
                | Self::Differs
                | Self::DoesNotHold
                | Self::Slip
                | Self::NotReproducible
                | Self::Damaged
                | Self::NotTested
                | Self::Error
        )
    }

    /// Whether the table `comparison` can have it.
    pub fn is_of_a_cell(self) -> bool {
        !matches!(
            self,
            Self::OrderingHolds | Self::Damaged | Self::Remark | Self::NotTested
        )
    }

    /// The verdict of that name. Fails with what there is, the nearest first.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|v| v.name() == name);
        found.ok_or_else(|| one_of(name, &Self::ALL.map(Self::name)))
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What was expected in place of `word`: one of `words`, with the nearest of them suggested.
pub fn one_of(word: &str, words: &[&str]) -> String {
    let all = listed(words.iter().copied());
    match nearest(word, words.iter().copied()) {
        Some(near) => format!("one of {all} (did you mean {near}?)"),
        None => format!("one of {all}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_verdict_has_one_name_and_they_are_shown_in_their_order() {
        let names: BTreeSet<&str> = Verdict::ALL.iter().map(|v| v.name()).collect();
        assert_eq!(names.len(), Verdict::ALL.len());
        assert!(Verdict::ALL.is_sorted());
        for v in Verdict::ALL {
            assert_eq!(Verdict::parse(v.name()), Ok(v));
            assert_eq!(v.is_success(), v.mark() == "✓", "{v}");
            assert!(!(v.is_success() && v.is_finding()), "{v}");
        }
    }

    #[test]
    fn what_is_fitted_or_agrees_by_accident_is_no_success() {
        assert!(!Verdict::Fitted.is_success() && !Verdict::ByAccident.is_success());
        assert!(!Verdict::Undecided.is_success() && !Verdict::Slip.is_success());
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_nearest() {
        let expected = Verdict::parse("does_not_holds").unwrap_err();
        assert!(
            expected.ends_with("(did you mean does_not_hold?)"),
            "{expected}"
        );
    }
}
