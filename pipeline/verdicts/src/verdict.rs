//! The verdicts: their order, their marks and what they mean.

use zonobench_lake::rows::Comparison;

/// A verdict, the mark that it is seen by, and what it means.
pub struct Verdict {
    /// As in the table `comparison`
    pub name: &'static str,
    /// A sign beside the name, so that a table can be skimmed
    pub mark: &'static str,
    /// In a sentence
    pub meaning: &'static str,
}

const fn verdict(name: &'static str, mark: &'static str, meaning: &'static str) -> Verdict {
    Verdict {
        name,
        mark,
        meaning,
    }
}

/// The verdicts in the order in which they are shown.
pub const ALL: &[Verdict] = &[
    verdict("exact", "✓", "the same number"),
    verdict(
        "within_rounding",
        "✓",
        "our number rounds to the printed one, or the printed one to ours",
    ),
    verdict(
        "within_ci",
        "✓",
        "the printed number lies in the interval in which a mean of as many runs as the paper's lies with 99 % (the \
         spread of both means, and half a unit of the last printed digit)",
    ),
    verdict(
        "within_tolerance",
        "✓",
        "the two differ by no more than a tolerance of this one number, whose reason stands beside it",
    ),
    verdict(
        "holds",
        "✓",
        "a claim in words, read as the comparison beside it, is true of our runs",
    ),
    verdict(
        "holds_as_bound",
        "✓",
        "a formula for a cost grows at least as fast as the cost that was counted",
    ),
    verdict(
        "differs",
        "✗",
        "the printed number is outside the interval or the tolerance; the reason says what we think why",
    ),
    verdict(
        "does_not_hold",
        "✗",
        "a claim in words, read as the comparison beside it, is false of our runs",
    ),
    verdict(
        "not_reproducible",
        "?",
        "the paper leaves out what would decide it, or this version does not measure it",
    ),
    verdict(
        "lost_in_source",
        "–",
        "the printed value is missing in the text that we have; ours is shown",
    ),
    verdict(
        "error",
        "‼",
        "there is no result for the cell: a fault of ours",
    ),
    verdict(
        "quick",
        "·",
        "a smoke run with few runs and steps: compared with nothing",
    ),
];

/// Place of a verdict in [`ALL`], the last for an unknown one.
pub fn rank(name: &str) -> usize {
    ALL.iter().position(|v| v.name == name).unwrap_or(ALL.len())
}

/// Mark and name, on one line.
pub fn shown(name: &str) -> String {
    match ALL.get(rank(name)) {
        Some(v) => format!("{}\u{a0}{}", v.mark, v.name),
        None => name.to_owned(),
    }
}

/// The mark alone.
pub fn mark(name: &str) -> &'static str {
    ALL.get(rank(name)).map_or("", |v| v.mark)
}

/// Whether the paper's number or claim came out.
pub fn is_reproduced(name: &str) -> bool {
    ALL.get(rank(name)).is_some_and(|v| v.mark == "✓")
}

/// Whether it is the paper's equations that were run, or a reading with a name.
pub fn is_as_written(c: &Comparison) -> bool {
    &*c.reading == "as-written"
}

/// How many cells have which verdict, as written, in the order of [`ALL`].
pub fn counts<'a>(cells: impl Iterator<Item = &'a Comparison>) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for c in cells.filter(|c| is_as_written(c)) {
        match counts.iter_mut().find(|(name, _)| **name == *c.verdict) {
            Some((_, n)) => *n += 1,
            None => counts.push((c.verdict.to_string(), 1)),
        }
    }
    counts.sort_by_key(|(name, _)| rank(name));
    counts
}
