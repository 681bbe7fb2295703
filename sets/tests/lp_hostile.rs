//! Programs that break solvers: the answer is right, wider, undecided, or an error that says why.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

mod rational;

use rational::{KINDS, Source, maximum, q, rows};
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::{Matrix, SetError};

fn loaded(a: &[&[f64]], b: &[f64], delta: &[f64]) -> LinearProgram {
    let mut lp = LinearProgram::new();
    lp.load(&Matrix::from_rows(a).unwrap(), b, delta).unwrap();
    lp
}

#[test]
fn without_rows_the_maximum_is_the_norm() {
    let mut lp = LinearProgram::new();
    lp.load(&Matrix::zeros(0, 3), &[], &[]).unwrap();
    let upper = lp.maximize(&[1.0, -2.0, 0.5]).unwrap().upper;
    assert!((3.5..3.5 + 1e-14).contains(&upper));
    assert!(matches!(lp.emptiness(), Emptiness::NonEmpty(_)));
}

#[test]
fn without_variables_the_rows_decide() {
    let mut lp = LinearProgram::new();
    lp.load(&Matrix::zeros(2, 0), &[0.0, 1e-3], &[0.0, 1e-2])
        .unwrap();
    assert!(lp.maximize(&[]).unwrap().upper >= 0.0);
    assert!(matches!(lp.emptiness(), Emptiness::NonEmpty(_)));
    lp.load(&Matrix::zeros(1, 0), &[1.0], &[0.0]).unwrap();
    assert_eq!(lp.emptiness(), Emptiness::Empty);
    assert!(matches!(lp.maximize(&[]), Err(SetError::Empty { .. })));
}

#[test]
fn zero_rows_are_nothing_or_a_contradiction() {
    let mut lp = loaded(&[&[0.0, 0.0], &[1.0, 1.0]], &[0.0, 1.0], &[0.0; 2]);
    let upper = lp.maximize(&[1.0, 0.0]).unwrap().upper;
    assert!((1.0..1.0 + 1e-14).contains(&upper));
    let mut lp = loaded(&[&[0.0, 0.0], &[1.0, 1.0]], &[1e-30, 1.0], &[0.0; 2]);
    assert!(lp.maximize(&[1.0, 0.0]).map_or(true, |m| m.upper >= 1.0));
}

#[test]
fn more_rows_than_variables() {
    let a: &[&[f64]] = &[&[1.0, 1.0], &[1.0, -1.0], &[2.0, 0.5]];
    let mut lp = loaded(a, &[0.75, 0.25, 1.125], &[0.0; 3]);
    // ξ = (0.5, 0.25) is the only point.
    for (d, value) in [([1.0, 0.0], 0.5), ([-1.0, 0.0], -0.5), ([0.0, 1.0], 0.25)] {
        let upper = lp.maximize(&d).unwrap().upper;
        assert!(upper >= value && upper < value + 1e-13, "{upper}");
    }
    let mut lp = loaded(a, &[0.75, 0.25, 1.2], &[0.0; 3]);
    assert_eq!(lp.emptiness(), Emptiness::Empty);
}

#[test]
fn bad_input_is_an_error() {
    let mut lp = LinearProgram::new();
    let a = Matrix::from_rows(&[[1.0, 2.0]]).unwrap();
    assert!(matches!(
        lp.load(&a, &[1.0, 2.0], &[0.0]),
        Err(SetError::Dimension {
            expected: 1,
            got: 2,
            ..
        })
    ));
    assert!(matches!(
        lp.load(&a, &[f64::NAN], &[0.0]),
        Err(SetError::NotFinite { .. })
    ));
    assert!(matches!(
        lp.load(&a, &[1.0], &[-1.0]),
        Err(SetError::Range { .. })
    ));
    lp.load(&a, &[1.0], &[0.0]).unwrap();
    assert!(matches!(
        lp.maximize(&[1.0]),
        Err(SetError::Dimension {
            expected: 2,
            got: 1,
            ..
        })
    ));
    assert!(matches!(
        lp.maximize(&[1.0, f64::INFINITY]),
        Err(SetError::NotFinite { .. })
    ));
}

#[test]
fn extreme_magnitudes_give_bounds_that_hold() {
    let mut s = Source(11);
    let mut lp = LinearProgram::new();
    for case in 0..300 {
        let (m, n) = (1 + s.below(3), 3 + s.below(4));
        let mut r = rows(&mut s, case % KINDS.len(), m, n);
        // Rows and single coefficients from 1e-300 to 1e300, so that scaling under- and overflows.
        for i in 0..m {
            let f = s.scale(150.0);
            r.a.row_mut(i).iter_mut().for_each(|x| *x *= f);
            r.b[i] *= f;
            if s.below(3) == 0 {
                r.a[(i, 0)] *= s.scale(140.0);
            }
        }
        if !r.a.is_finite() || r.b.iter().any(|b| !b.is_finite()) {
            continue;
        }
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        let d: Vec<f64> = s.vector(n).iter().map(|x| x * s.scale(100.0)).collect();
        let truth = maximum(&r.a, &r.b, &r.delta, &d);
        match lp.maximize(&d) {
            Ok(found) => assert!(truth.is_none_or(|t| q(found.upper) >= t)),
            Err(SetError::Empty { .. }) => assert!(truth.is_none()),
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn ties_everywhere_do_not_make_it_cycle() {
    let mut s = Source(12);
    let mut lp = LinearProgram::new();
    for _ in 0..200 {
        let (m, n) = (5 + s.below(20), 30 + s.below(60));
        let r = rows(&mut s, 4, m, n);
        lp.load(&r.a, &r.b, &r.delta).unwrap();
        let d: Vec<f64> = (0..n).map(|_| s.below(3) as f64 - 1.0).collect();
        assert!(lp.maximize(&d).unwrap().optimal);
        assert!(lp.maximize(&vec![0.0; n]).unwrap().optimal);
    }
    let work = lp.work();
    assert!(
        work.unfinished == 0 && work.pivots < 200 * work.programs,
        "{work:?}"
    );
}

#[test]
fn a_warm_start_changes_the_work_and_not_the_answer() {
    let mut s = Source(13);
    let (mut cold, mut warm) = (LinearProgram::new(), LinearProgram::new());
    let mut r = rows(&mut s, 0, 10, 40);
    let d: Vec<Vec<f64>> = (0..10).map(|_| s.vector(40)).collect();
    for _ in 0..20 {
        r.a.as_mut_slice()
            .iter_mut()
            .for_each(|x| *x += 1e-3 * s.normal());
        cold.load(&r.a, &r.b, &r.delta).unwrap();
        warm.load_warm(&r.a, &r.b, &r.delta).unwrap();
        for d in &d {
            let (x, y) = (
                cold.maximize(d).unwrap().upper,
                warm.maximize(d).unwrap().upper,
            );
            assert!((x - y).abs() < 1e-11, "{x} {y}");
        }
    }
}

#[test]
fn the_same_program_gives_the_same_bits() {
    let mut s = Source(14);
    for case in 0..90 {
        let r = rows(&mut s, case % KINDS.len(), 6, 25);
        let d = s.vector(25);
        let run = || {
            let mut lp = LinearProgram::new();
            lp.load(&r.a, &r.b, &r.delta).unwrap();
            let upper = lp.maximize(&d).map(|m| m.upper.to_bits());
            (upper, format!("{:?}", lp.emptiness()), lp.work())
        };
        assert_eq!(run(), run());
    }
}
