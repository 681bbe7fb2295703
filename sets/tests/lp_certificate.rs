//! The certified bounds of the linear programs against exact rational arithmetic.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

mod rational;

use num_traits::{Signed, ToPrimitive};
use rational::{KINDS, Source, core, maximum, q, rows};
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::{Matrix, SetError};

#[test]
fn a_bound_is_above_the_exact_value_for_its_own_multipliers() {
    let mut s = Source(1);
    let mut lp = LinearProgram::new();
    for case in 0..300 {
        let kind = case % KINDS.len();
        let (m, n) = (1 + s.below(8), 8 + s.below(20));
        let r = rows(&mut s, kind, m, n);
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        for _ in 0..2 {
            let d = s.vector(n);
            let Ok(maximum) = lp.maximize(&d) else {
                continue;
            };
            let exact = core(&r.a, &r.b, &r.delta, &d, &lp.multipliers());
            let cap = d.iter().fold(q(0.0), |t, &x| t + q(x).abs());
            let exact = exact.min(cap);
            assert!(
                q(maximum.upper) >= exact,
                "{} ({m}, {n}): {} < {exact}",
                KINDS[kind],
                maximum.upper
            );
        }
    }
}

#[test]
fn a_bound_is_never_below_the_exact_maximum_and_close_to_it() {
    let mut s = Source(2);
    let mut lp = LinearProgram::new();
    let (mut solved, mut empty, mut undecided) = (0, 0, 0);
    for case in 0..450 {
        let kind = case % KINDS.len();
        let (m, n) = (1 + s.below(4), 4 + s.below(6));
        let r = rows(&mut s, kind, m, n);
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        for _ in 0..2 {
            let d = s.vector(n);
            let truth = maximum(&r.a, &r.b, &r.delta, &d);
            match (lp.maximize(&d), truth) {
                (Ok(found), Some(truth)) => {
                    let excess = (q(found.upper) - &truth).to_f64().unwrap();
                    assert!(
                        excess >= 0.0,
                        "{} ({m}, {n}): inside by {excess}",
                        KINDS[kind]
                    );
                    // A dependent row differs from its combination by a rounding, which the exact program
                    // enforces and the simplex leaves alone: hold the bound against the independent rows.
                    let excess = match kind {
                        1 | 3 => {
                            let kept: Vec<usize> =
                                (0..m).filter(|&i| i < 2 || i % 2 == 1).collect();
                            let a = Matrix::from_fn(kept.len(), n, |i, j| r.a[(kept[i], j)]);
                            let pick = |v: &[f64]| kept.iter().map(|&i| v[i]).collect::<Vec<_>>();
                            let relaxed = maximum(&a, &pick(&r.b), &pick(&r.delta), &d).unwrap();
                            (q(found.upper) - relaxed).to_f64().unwrap()
                        }
                        _ => excess,
                    };
                    // Barely feasible sets are one point within 1e-12 of nothing: the multipliers blow up.
                    let tolerance = if kind == 5 { 1e-4 } else { 1e-9 };
                    assert!(
                        excess <= tolerance,
                        "{} ({m}, {n}): outside by {excess}",
                        KINDS[kind]
                    );
                    solved += 1;
                }
                (Err(SetError::Empty { .. }), None) => empty += 1,
                (Ok(_), None) => undecided += 1,
                (other, truth) => panic!("{}: {other:?} against {truth:?}", KINDS[kind]),
            }
        }
    }
    println!("solved {solved}, proved empty {empty}, empty within rounding {undecided}");
    assert!(solved > 500 && empty > 20);
}

#[test]
fn emptiness_is_never_claimed_wrongly_either_way() {
    let mut s = Source(3);
    let mut lp = LinearProgram::new();
    let mut count = [0; 3];
    for case in 0..450 {
        let kind = case % KINDS.len();
        let (m, n) = (1 + s.below(4), 4 + s.below(6));
        let r = rows(&mut s, kind, m, n);
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        let truth = maximum(&r.a, &r.b, &r.delta, &vec![0.0; n]);
        match lp.emptiness() {
            Emptiness::Empty => {
                assert!(truth.is_none(), "{} called empty", KINDS[kind]);
                count[0] += 1;
            }
            Emptiness::NonEmpty(xi) => {
                // The claim is about the set with the stated slack: check it exactly.
                assert!(xi.iter().all(|x| x.abs() <= 1.0));
                for i in 0..m {
                    let size: f64 = r.a.row(i).iter().map(|x| x.abs()).sum::<f64>() + r.b[i].abs();
                    let sigma = 2.0 * (n + 2) as f64 * f64::EPSILON / 2.0 * 1.01 * size;
                    let value =
                        r.a.row(i)
                            .iter()
                            .zip(&xi)
                            .fold(-q(r.b[i]), |t, (&a, &x)| t + q(a) * q(x));
                    assert!(
                        value.abs() <= q(r.delta[i] + sigma),
                        "{}: row {i}",
                        KINDS[kind]
                    );
                }
                count[1] += 1;
            }
            Emptiness::Undecided { margin } => {
                assert!(
                    margin > 0.0 && margin < 1e-6,
                    "{}: margin {margin}",
                    KINDS[kind]
                );
                count[2] += 1;
            }
        }
    }
    println!("empty, non-empty, undecided: {count:?}");
    assert!(count[0] > 20 && count[1] > 350 && count[2] < 20);
}

#[test]
fn a_second_opinion_agrees_within_its_tolerance() {
    let mut s = Source(4);
    let (mut lp, mut other) = (LinearProgram::new(), LinearProgram::new());
    for case in 0..90 {
        let kind = case % KINDS.len();
        if kind == 5 || kind == 6 {
            continue;
        }
        let (m, n) = (1 + s.below(6), 10 + s.below(20));
        let r = rows(&mut s, kind, m, n);
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        other.load(&r.a, &r.b, &r.delta).unwrap();
        let d = s.vector(n);
        let (first, second) = (lp.maximize(&d), other.maximize_by_interior_point(&d));
        let (first, second) = (first.unwrap().upper, second.unwrap());
        // An interior point's multipliers are feasible to 1e-11 of sizes up to some hundreds.
        assert!(
            (first - second).abs() < 1e-6,
            "{} ({m}, {n}): {first} {second}",
            KINDS[kind]
        );
        if m <= 3 && n <= 14 {
            let truth = maximum(&r.a, &r.b, &r.delta, &d).unwrap();
            assert!(q(second) >= truth);
        }
    }
}
