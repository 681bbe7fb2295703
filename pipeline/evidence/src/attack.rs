//! attack: the campaign against the guarantees, counted.

use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use zonobench_attack::{
    Attack as Kind, Case, Counts, Own, attack_own, cases, clopper_pearson_upper,
};
use zonobench_lake::error::Error;
use zonobench_lake::rows::Attack;
use zonobench_lake::table;
use zonobench_lake::table::metadata;

/// The file that it writes.
pub const FILE: &str = "attack.parquet";

/// The confidence of the bound on the rate.
pub const CONFIDENCE: f64 = 0.95;

/// The families of problems that estimators of `paper` are attacked on.
pub fn systems(paper: &str) -> Vec<&'static str> {
    let mut systems: Vec<&str> = of(paper, None).iter().map(|case| case.system).collect();
    systems.dedup();
    let mut seen = Vec::new();
    systems.retain(|s| {
        !seen.contains(s) && {
            seen.push(s);
            true
        }
    });
    systems
}

fn of(paper: &str, system: Option<&str>) -> Vec<Case> {
    let wanted = |case: &Case| case.paper == paper && system.is_none_or(|s| s == case.system);
    cases().into_iter().filter(wanted).collect()
}

/// How much is attacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// One unit a case: a smoke test.
    Quick,
    /// So many times the default campaign.
    Times(u64),
}

impl Size {
    fn units(self, case: &Case) -> u64 {
        match self {
            Size::Quick => 1,
            Size::Times(times) => case.units * times,
        }
    }
}

/// What the counts depend on, beside the code.
pub fn input(paper: &str, system: &str, size: Size) -> Value {
    let cases: Vec<Value> = of(paper, Some(system))
        .iter()
        .map(|c| json!([c.estimator, c.attack, size.units(c)]))
        .collect();
    json!({ "paper": paper, "system": system, "cases": cases })
}

/// Runs every case of `paper` on `system`.
///
/// `done` is told of every finished unit. Fails where a problem cannot be simulated or a step fails.
pub fn count(
    paper: &str,
    system: &str,
    size: Size,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Attack>, Error> {
    let cases = of(paper, Some(system));
    let units: Vec<(usize, u64)> = cases
        .iter()
        .enumerate()
        .flat_map(|(i, case)| (0..size.units(case)).map(move |unit| (i, unit)))
        .collect();
    let counted: Vec<(usize, Counts)> = units
        .into_par_iter()
        .map(|(i, unit)| {
            let counts = cases[i].count(unit).map_err(Error::Attack)?;
            done(1);
            Ok((i, counts))
        })
        .collect::<Result<_, Error>>()?;
    let mut sums = vec![Counts::default(); cases.len()];
    for (i, counts) in counted {
        sums[i] += counts;
    }
    Ok(cases
        .iter()
        .zip(sums)
        .map(|(case, sum)| row(case, sum))
        .collect())
}

/// How many units [`count`] runs.
pub fn units(paper: &str, system: &str, size: Size) -> u64 {
    of(paper, Some(system))
        .iter()
        .map(|case| size.units(case))
        .sum()
}

fn row(case: &Case, counts: Counts) -> Attack {
    counted(case.estimator, &case.attack, case.guaranteed, counts)
}

fn counted(estimator: &str, attack: &str, guaranteed: bool, counts: Counts) -> Attack {
    Attack {
        estimator: estimator.into(),
        attack: attack.into(),
        steps: counts.steps as i64,
        lost: counts.lost as i64,
        empty: counts.empty as i64,
        rate_hi: clopper_pearson_upper(counts.lost, counts.steps, CONFIDENCE),
        undecided: counts.undecided as i64,
        refused: counts.refused as i64,
        guaranteed,
    }
}

/// Runs of every attack on an estimator of a problem of a user's own, in the default campaign.
const OWN_RUNS: u64 = 1;

impl Size {
    fn own_runs(self) -> u64 {
        match self {
            Size::Quick => 1,
            Size::Times(times) => OWN_RUNS * times,
        }
    }
}

/// What the counts of a user's own problems depend on, beside the code.
pub fn own_input(owns: &[Own], size: Size) -> Value {
    let cases: Vec<Value> = owns
        .iter()
        .map(|own| {
            let (system, estimator, settings) = (&own.system, &own.estimator, &own.settings);
            json!([system, estimator, settings, own.problem, own.inputs])
        })
        .collect();
    json!({ "runs": size.own_runs(), "cases": cases })
}

/// How many units [`count_own`] runs.
pub fn own_units(owns: &[Own], size: Size) -> u64 {
    owns.len() as u64 * Kind::ALL.len() as u64 * size.own_runs()
}

/// Attacks each of `owns`; as [`count`].
pub fn count_own(
    owns: &[Own],
    size: Size,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Attack>, Error> {
    let cases: Vec<(&Own, Kind)> = owns
        .iter()
        .flat_map(|own| Kind::ALL.map(|kind| (own, kind)))
        .collect();
    let one = |(own, kind): (&Own, Kind)| {
        let mut sum = Counts::default();
        for run in 0..size.own_runs() {
            sum += attack_own(own, kind, run).map_err(Error::Attack)?;
            done(1);
        }
        Ok(counted(&own.estimator, kind.name(), true, sum))
    };
    cases.into_par_iter().map(one).collect()
}

/// Writes the counts of [`count_own`].
pub fn make_own(
    owns: &[Own],
    size: Size,
    dir: &Path,
    done: &(dyn Fn(u64) + Sync),
) -> Result<(), Error> {
    let rows = count_own(owns, size, done)?;
    table::write(&dir.join(FILE), rows, &metadata("attack", None))?;
    Ok(())
}

/// Writes the counts.
pub fn make(
    paper: &str,
    system: &str,
    size: Size,
    dir: &Path,
    done: &(dyn Fn(u64) + Sync),
) -> Result<(), Error> {
    let rows = count(paper, system, size, done)?;
    table::write(&dir.join(FILE), rows, &metadata("attack", None))?;
    Ok(())
}
