//! Claims: a comparison put to the runs, and the verdicts of the ledger and of the counts.

use super::interval;
use super::numbers::Number;
use super::{Results, Row};
use crate::published::{Asked, Cell, Published, Quantifier};
use crate::verdict::Verdict;
use zonobench_lake::digits::four_digits;

impl Results<'_> {
    /// A claim put to the runs.
    pub(super) fn asked(&self, p: &Published, cell: &Cell, asked: Asked, number: Number) -> Row {
        let (plain, evidence) = decided(asked, &number);
        let verdict = cell.finding.on(plain);
        let reason = match cell.finding.is_shown(verdict) {
            // A finding tells the mean itself; what names a run, or an interval, is told beside it.
            true if asked.quantifier == Quantifier::Mean && plain != Verdict::Undecided => {
                self.fill(p, cell, &number, None, None)
            }
            true => format!(
                "{}; {evidence}",
                self.fill(p, cell, &number, None, None)
                    .trim_end_matches('.')
            ),
            false if p.reason.is_empty() => format!("{evidence}; asked for {asked}"),
            false => format!("{evidence}; asked for {asked}: {}", p.reason),
        };
        Row {
            reproduced: Some(number.value),
            ..Row::of(p, &cell.reading, verdict, reason)
        }
    }

    /// The verdict of the ledger on the claim that a cell names.
    pub(super) fn ledger(&self, p: &Published, cell: &Cell, name: &str) -> Row {
        let error = |reason: String| Row::of(p, &cell.reading, Verdict::Error, reason);
        let Some(claim) = self.ledgers.claims.iter().find(|c| *c.claim == *name) else {
            return error(format!("no claim {name:?} in the ledger"));
        };
        let plain = match Verdict::parse(&claim.verdict) {
            Ok(Verdict::Damaged) => Verdict::LostInSource,
            Ok(Verdict::Remark) => {
                return error(format!(
                    "{name:?} is a remark of ours, which no printed claim is held against"
                ));
            }
            Ok(verdict) if verdict != Verdict::NotTested => verdict,
            _ => return error(format!("{name:?} has the verdict {}", claim.verdict)),
        };
        let verdict = cell.finding.on(plain);
        let evidence = match claim.counterexample.is_empty() {
            // The trials lost of a false claim measure who drew them; those of a true one say how hard it was tried.
            true => format!("none of {} exact trials lost", claim.trials),
            false => claim.counterexample.to_string(),
        };
        let parts = [
            self.shown_text(cell, verdict),
            evidence,
            claim.consequence.to_string(),
        ];
        Row::of(p, &cell.reading, verdict, joined(&parts))
    }

    /// The verdict of the claim about cost that a cell names.
    pub(super) fn counted(&self, p: &Published, cell: &Cell, name: &str) -> Row {
        let mut all = self.ledgers.complexity.iter();
        let Some(claim) = all.find(|r| r.sweep_variable.is_none() && *r.claim == *name) else {
            let reason = format!("no claim {name} was counted");
            return Row::of(p, &cell.reading, Verdict::Error, reason);
        };
        let Ok(plain) = Verdict::parse(&claim.verdict) else {
            let reason = format!("{name} has the verdict {}", claim.verdict);
            return Row::of(p, &cell.reading, Verdict::Error, reason);
        };
        // What a count means is told beside it, whatever it is.
        let parts = [self.text(cell), claim.reason.to_string()];
        let reason = match &parts[..] {
            [text, reason] if !text.is_empty() => {
                format!("{}: {reason}", text.trim_end_matches(['.', ':']))
            }
            _ => claim.reason.to_string(),
        };
        Row::of(p, &cell.reading, cell.finding.on(plain), reason)
    }

    fn shown_text(&self, cell: &Cell, verdict: Verdict) -> String {
        match cell.finding.is_shown(verdict) {
            true => self.text(cell),
            false => String::new(),
        }
    }
}

/// Sentences, one after the other.
fn joined(parts: &[String]) -> String {
    let parts: Vec<&str> = parts
        .iter()
        .map(|part| part.trim_end_matches('.'))
        .filter(|part| !part.is_empty())
        .collect();
    parts.join("; ")
}

/// Whether the runs satisfy what is asked, and what shows it.
///
/// Of a mean whose 99 % interval has numbers of which the comparison is true and others of which it is false, neither
/// is said. `== x` is exact: it is asked of shares that are to be 0 or 1 in every run.
fn decided(asked: Asked, number: &Number) -> (Verdict, String) {
    let Asked {
        quantifier,
        comparison,
    } = asked;
    let of = |holds: bool| match holds {
        true => Verdict::Holds,
        false => Verdict::DoesNotHold,
    };
    let runs = &number.of_runs;
    let first = |wanted: bool| runs.iter().position(|x| comparison.holds(*x) == wanted);
    let count = runs.iter().filter(|x| comparison.holds(**x)).count();
    match quantifier {
        Quantifier::Some => match first(true) {
            Some(run) => (
                Verdict::Holds,
                format!(
                    "run {run} gives {}, and {count} of {} runs do so",
                    four_digits(runs[run]),
                    runs.len()
                ),
            ),
            None => (
                Verdict::DoesNotHold,
                format!("none of {} runs does: {}", runs.len(), range(runs)),
            ),
        },
        Quantifier::Every => match first(false) {
            Some(run) => (
                Verdict::DoesNotHold,
                format!(
                    "run {run} gives {}, and {} of {} runs fail",
                    four_digits(runs[run]),
                    runs.len() - count,
                    runs.len()
                ),
            ),
            None => (
                Verdict::Holds,
                format!("each of {} runs does: {}", runs.len(), range(runs)),
            ),
        },
        Quantifier::Mean => {
            let measured = format!(
                "measured {} over {} runs",
                four_digits(number.value),
                runs.len()
            );
            let exact = matches!(comparison, crate::published::Comparison::Equal(_));
            match number.mean.filter(|_| !exact) {
                None => (of(comparison.holds(number.value)), measured),
                Some((lo, hi)) => {
                    let (lo, hi) = (number.value + lo, number.value + hi);
                    let shown = format!("{measured}, the mean in {} with 99 %", interval(lo, hi));
                    match comparison.of_interval(lo, hi) {
                        (true, false) => (
                            Verdict::Undecided,
                            format!("{shown}, which holds both outcomes"),
                        ),
                        (some, _) => (of(some), shown),
                    }
                }
            }
        }
    }
}

/// `0.1 to 0.3`.
fn range(values: &[f64]) -> String {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if least == greatest {
        four_digits(least)
    } else {
        format!("{} to {}", four_digits(least), four_digits(greatest))
    }
}
