//! Verdicts as Markdown: the mark with the name, and the legend.

use crate::report::markdown;
use crate::verdict::Verdict;

/// Mark and name, on one line.
pub fn shown(verdict: Verdict) -> String {
    format!("{}\u{a0}{verdict}", verdict.mark())
}

/// The verdicts of cells and their meanings as a table.
pub fn legend() -> String {
    let rows: Vec<Vec<String>> = Verdict::ALL
        .iter()
        .filter(|v| v.is_of_a_cell())
        .map(|v| vec![shown(*v), v.meaning().to_owned()])
        .collect();
    markdown::table(&["verdict", "meaning"], &rows)
}
