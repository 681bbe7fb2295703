//! The ledger of the papers' claims on the terminal.

use crate::claims;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Claim;

/// Tries the claims of `paper` (of all if none), or one of them, and prints what came out.
pub fn render(paper: Option<&str>, claim: Option<&str>) -> Result<String, Error> {
    if let Some(unknown) = paper.filter(|p| !zonobench_claims::PAPERS.contains(p)) {
        return Err(Error::Unknown {
            what: "paper",
            got: unknown.to_owned(),
            expected: format!("papers: {}", zonobench_claims::PAPERS.join(", ")),
        });
    }
    let wanted =
        |own: &str, id: &str| paper.is_none_or(|p| p == own) && claim.is_none_or(|c| c == id);
    let rows = claims::rows(wanted);
    if rows.is_empty() {
        let known: Vec<String> = zonobench_claims::all()
            .iter()
            .filter(|c| paper.is_none_or(|p| p == c.paper))
            .map(|c| format!("{} {}", c.paper, c.id))
            .collect();
        return Err(Error::Unknown {
            what: "claim",
            got: claim.unwrap_or_default().to_owned(),
            expected: format!("claims: {}", known.join(", ")),
        });
    }
    if claim.is_some() {
        return Ok(rows
            .iter()
            .map(|(paper, row)| in_full(paper, row))
            .collect());
    }
    let width = rows.iter().map(|(_, r)| r.claim.len()).max().unwrap_or(0);
    let mut out = format!("paper   {:width$}  verdict         lost/trials\n", "claim");
    for (paper, row) in &rows {
        out += &format!(
            "{paper:6}  {:width$}  {:14}  {}/{}\n",
            row.claim, row.verdict, row.lost, row.trials
        );
        if !row.counterexample.is_empty() {
            out += &format!("          {}\n", row.counterexample);
        }
    }
    let failing = rows.iter().filter(|(_, r)| &*r.verdict != "holds").count();
    Ok(format!(
        "{out}{} claims, {failing} of them not as printed\n",
        rows.len()
    ))
}

fn in_full(paper: &str, row: &Claim) -> String {
    let mut out = format!(
        "{paper} {}: {}\n  says: {}\n  {} of {} trials lost\n",
        row.claim, row.verdict, row.statement, row.lost, row.trials
    );
    for (label, text) in [
        ("counterexample", &row.counterexample),
        ("consequence", &row.consequence),
    ] {
        if !text.is_empty() {
            out += &format!("  {label}: {text}\n");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_claim_is_rerun_and_a_wrong_name_is_told() {
        let text = render(Some("ezgkf"), Some("remark-4")).unwrap();
        assert!(text.starts_with("ezgkf remark-4: does_not_hold"), "{text}");
        assert!(text.contains("-6 becomes -4"), "{text}");
        let error = render(Some("ezgkf"), Some("remark-44"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("remark-44"), "{error}");
        assert!(render(Some("nobody"), None).is_err());
    }
}
