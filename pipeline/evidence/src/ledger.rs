//! The ledger of the papers' claims on the terminal.

use crate::claims;
use zonobench_claims::Verdict;
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
    let is_remark = |r: &Claim| &*r.verdict == Verdict::Remark.name();
    let (remarks, own): (Vec<_>, Vec<_>) = rows.iter().partition(|(_, r)| is_remark(r));
    let line = |(paper, row): &(&str, Claim)| {
        let shown = match row.counterexample.is_empty() {
            true => format!("{} trials", row.trials),
            false => row.counterexample.to_string(),
        };
        format!(
            "{paper:6}  {:width$}  {:14}  {shown}\n",
            row.claim, row.verdict
        )
    };
    let mut out = format!(
        "paper   {:width$}  verdict         counterexample\n",
        "claim"
    );
    out.extend(own.iter().map(|row| line(row)));
    let failing = own
        .iter()
        .filter(|(_, r)| &*r.verdict != Verdict::Holds.name())
        .count();
    out += &format!("{} claims, {failing} of them not as printed\n", own.len());
    if !remarks.is_empty() {
        out += "\nRemarks of ours, which the papers do not make:\n";
        out.extend(remarks.iter().map(|row| line(row)));
    }
    Ok(out)
}

fn in_full(paper: &str, row: &Claim) -> String {
    let tried = match row.counterexample.is_empty() {
        true => format!("none of {} trials lost", row.trials),
        false => format!("counterexample: {}", row.counterexample),
    };
    let mut out = format!(
        "{paper} {}: {}\n  says: {}\n  {tried}\n",
        row.claim, row.verdict, row.statement
    );
    if !row.consequence.is_empty() {
        out += &format!("  consequence: {}\n", row.consequence);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_claim_is_rerun_and_a_wrong_name_is_told() {
        // Whatever it says of the paper, a claim is shown with what was tried.
        let first = zonobench_claims::all().into_iter().next().unwrap();
        let text = render(Some(first.paper), Some(first.id)).unwrap();
        let start = format!("{} {}: ", first.paper, first.id);
        assert!(
            text.starts_with(&start) && text.contains(first.statement),
            "{text}"
        );
        let error = render(Some("ezgkf"), Some("remark-44"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("remark-44"), "{error}");
        assert!(render(Some("nobody"), None).is_err());
    }
}
