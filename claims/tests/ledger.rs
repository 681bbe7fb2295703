//! The whole ledger: its names, that it is repeatable, and that every repair holds where the claim does not.

use std::collections::BTreeSet;
use zonobench_claims::{PAPERS, Verdict, all};

#[test]
fn every_claim_has_one_name_and_a_statement() {
    let mut seen = BTreeSet::new();
    for claim in all() {
        assert!(seen.insert((claim.paper, claim.id)), "{}", claim.id);
        assert!(!claim.statement.is_empty(), "{}", claim.id);
    }
    let papers: BTreeSet<&str> = seen.iter().map(|(paper, _)| *paper).collect();
    assert_eq!(papers, BTreeSet::from(PAPERS));
}

#[test]
fn every_claim_is_tried_and_every_repair_holds() {
    for claim in all() {
        let o = claim.outcome();
        let name = format!("{} {}: {o:?}", claim.paper, claim.id);
        assert!(o.trials > 0 && o.verdict != Verdict::NotTested, "{name}");
        assert_eq!(o.repaired_lost, 0, "{name}");
        // A claim that fails shows where, and what follows.
        let fails = o.verdict != Verdict::Holds;
        assert_eq!(fails, o.lost > 0, "{name}");
        assert_eq!(fails, !o.counterexample.is_empty(), "{name}");
        assert!(!fails || !claim.consequence.is_empty(), "{name}");
    }
}

#[test]
fn an_outcome_does_not_depend_on_what_ran_before() {
    let last = |id: &str| {
        let claim = all().into_iter().find(|c| c.id == id).unwrap();
        claim.outcome()
    };
    let alone = last("corollary-1");
    last("lemma-1");
    assert_eq!(alone, last("corollary-1"));
}

#[test]
fn every_damaged_twin_loses() {
    for claim in all() {
        let whole = claim.outcome();
        for twin in &claim.twins {
            let o = claim.outcome_of(twin);
            let name = format!("{} {}, {}: {o:?}", claim.paper, claim.id, twin.damage);
            // Where the claim itself loses, it is the repaired one that the twin damages.
            let lost = if whole.lost == 0 {
                o.lost
            } else {
                o.repaired_lost
            };
            assert!(lost > 0, "{name}");
        }
    }
}

/// The papers whose every trial has been shown to be one that can refute.
const DAMAGED: [&str; 3] = ["box", "ezgkf", "inzsmf"];

#[test]
fn every_claim_has_a_damaged_twin() {
    for claim in all().iter().filter(|c| DAMAGED.contains(&c.paper)) {
        assert!(!claim.twins.is_empty(), "{} {}", claim.paper, claim.id);
    }
}
