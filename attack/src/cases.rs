//! The campaign as a list of cases that are counted alone.

use crate::campaign::{Counts, attack};
use crate::strips::{MARGINS, near_empty};
use crate::targets::{TARGETS, Target};
use crate::{Attack, hulls};

/// Sets in one unit of a case about sets.
const SETS: u64 = 250;

/// One row of the campaign: one target under one attack.
#[derive(Clone, Debug)]
pub struct Case {
    /// The paper whose estimator or set is attacked.
    pub paper: &'static str,
    /// The family of problems; `sets` where sets are attacked without a filter.
    pub system: &'static str,
    /// The estimator, or the operation on sets.
    pub estimator: &'static str,
    /// How it is attacked.
    pub attack: String,
    /// Whether none may be lost.
    pub guaranteed: bool,
    /// Units in the default campaign: runs, or batches of sets.
    pub units: u64,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Runs(&'static Target, Attack),
    Hulls(hulls::Kind),
    Slivers(i32),
}

impl Case {
    /// Counts unit `unit`, which depends on nothing but the case and this number.
    ///
    /// Fails with a text that says what could not be run.
    pub fn count(&self, unit: u64) -> Result<Counts, String> {
        match self.what {
            What::Runs(target, kind) => attack(target, kind, unit),
            What::Hulls(kind) => Ok(hulls::attack(kind, unit * SETS, SETS)),
            What::Slivers(margin) => Ok(near_empty(margin, unit * SETS, SETS)),
        }
    }
}

/// Every case, in the order of the tables.
pub fn cases() -> Vec<Case> {
    let runs = TARGETS.iter().flat_map(|target| {
        Attack::ALL.map(|kind| Case {
            paper: target.paper,
            system: target.system,
            estimator: target.name,
            attack: kind.name().to_owned(),
            guaranteed: target.guaranteed,
            units: target.runs,
            what: What::Runs(target, kind),
        })
    });
    let sets = |estimator, attack, what| Case {
        paper: "cz",
        system: "sets",
        estimator,
        attack,
        guaranteed: true,
        units: 8,
        what,
    };
    let hulls = hulls::Kind::ALL
        .map(|(kind, name)| sets("interval hull", name.to_owned(), What::Hulls(kind)));
    let slivers = MARGINS.map(|margin| {
        let name = format!("half-space 2^-{margin} within and beyond");
        sets("intersection", name, What::Slivers(margin))
    });
    runs.chain(hulls).chain(slivers).collect()
}
