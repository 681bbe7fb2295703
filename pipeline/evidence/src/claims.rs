//! claims: a paper's numbered claims, put to the test in exact arithmetic.

use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use zonobench_lake::error::Error;
use zonobench_lake::rows::Claim;
use zonobench_lake::table;
use zonobench_lake::table::metadata;

/// What the ledger of a paper depends on: the claims themselves are code.
pub fn input(paper: &str) -> Value {
    json!({ "claims_of": paper })
}

/// The rows of the claims that `wanted` takes, in order, each tried on a thread of its own.
pub fn rows(wanted: impl Fn(&str, &str) -> bool) -> Vec<(&'static str, Claim)> {
    let claims: Vec<zonobench_claims::Claim> = zonobench_claims::all()
        .into_iter()
        .filter(|c| wanted(c.paper, c.id))
        .collect();
    claims
        .par_iter()
        .map(|claim| {
            let outcome = claim.outcome();
            let row = Claim {
                claim: claim.id.into(),
                statement: claim.statement.into(),
                verdict: claim.verdict(&outcome).name().into(),
                trials: outcome.trials as i64,
                lost: outcome.lost as i64,
                counterexample: outcome.counterexample.as_str().into(),
                consequence: claim.consequence(&outcome).into(),
            };
            (claim.paper, row)
        })
        .collect()
}

/// The file that it writes.
pub const FILE: &str = "claims.parquet";

/// Writes [`FILE`].
pub fn make(paper: &str, dir: &Path) -> Result<(), Error> {
    let rows = rows(|own, _| own == paper).into_iter().map(|(_, row)| row);
    table::write(&dir.join(FILE), rows, &metadata("claims", None))?;
    Ok(())
}
