//! count: the papers' claims about cost, held against counted operations.

use serde_json::{Value, json};
use std::path::Path;
use zonobench_complexity::{PAPERS, Row, count};
use zonobench_lake::error::Error;
use zonobench_lake::rows::Complexity;
use zonobench_lake::table;
use zonobench_lake::table::metadata;

/// The file that it writes.
pub const FILE: &str = "complexity.parquet";

/// What the counts of a paper depend on; None for a paper that claims no cost.
pub fn input(paper: &str) -> Option<Value> {
    PAPERS
        .contains(&paper)
        .then(|| json!({ "paper": paper, "seed": zonobench_complexity::instance::SEED }))
}

/// Writes [`FILE`].
pub fn make(paper: &str, dir: &Path) -> Result<(), Error> {
    let meta = metadata("count", Some(zonobench_complexity::instance::SEED));
    let rows = count(paper).into_iter().map(row);
    table::write(&dir.join(FILE), rows, &meta)?;
    Ok(())
}

fn row(row: Row) -> Complexity {
    let finite = |x: f64| Some(x).filter(|x| x.is_finite());
    let degree = |f: fn(&zonobench_complexity::fit::Degree) -> f64| {
        row.degree.as_ref().map(f).and_then(finite)
    };
    Complexity {
        claim: row.claim.as_str().into(),
        sweep_variable: (!row.sweep_variable.is_empty())
            .then(|| row.sweep_variable.as_str().into()),
        size: row.size,
        counted: row.counted,
        formula: row.formula,
        ratio: row.ratio.and_then(finite),
        fitted_degree: degree(|d| d.value),
        degree_lo: degree(|d| d.lo),
        degree_hi: degree(|d| d.hi),
        verdict: row.verdict.name().into(),
        reason: row.reason.as_str().into(),
    }
}

/// The rows as text: a claim's verdict and reason, then its sweeps.
pub fn text(rows: &[Complexity]) -> String {
    use zonobench_lake::digits::four_digits;
    let mut out = String::new();
    let mut sweep = None;
    for r in rows {
        let Some(variable) = &r.sweep_variable else {
            out += &format!("\n{}: {}\n  {}\n", r.claim, r.verdict, r.reason);
            sweep = None;
            continue;
        };
        if sweep != Some(variable) {
            let degree = match (r.fitted_degree, r.degree_lo, r.degree_hi) {
                (Some(d), Some(lo), Some(hi)) if lo == hi => format!(", degree {d} exactly"),
                (Some(d), Some(lo), Some(hi)) => {
                    format!(", degree {d:.2} in [{lo:.2}, {hi:.2}]")
                }
                (Some(d), ..) => format!(", degree {d:.2}"),
                _ => String::new(),
            };
            out += &format!("  {variable}{degree}: {}\n", r.verdict);
            out += &format!(
                "    {:>10} {:>12} {:>12} {:>8}\n",
                "size", "counted", "formula", "ratio"
            );
            sweep = Some(variable);
        }
        let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), four_digits);
        out += &format!(
            "    {:>10} {:>12} {:>12} {:>8}\n",
            r.size.unwrap_or_default(),
            number(r.counted),
            number(r.formula),
            number(r.ratio)
        );
    }
    out
}
