//! Programs whose dual steps do not move end within a bounded number of pivots, none given up.
//!
//! Most coefficients of their objectives are 0, or equal, so that most reduced costs are 0.

#![allow(clippy::disallowed_methods)] // powers of two, and the platform's functions in the drawing

mod rational;

use rational::Source;
use zonobench_sets::Matrix;
use zonobench_sets::lp::LinearProgram;

/// An engine with the rows A ξ = A ξ₀.
fn through(a: &Matrix, source: &mut Source) -> LinearProgram {
    let xi: Vec<f64> = (0..a.cols()).map(|_| signed(source)).collect();
    let mut lp = LinearProgram::new();
    let b = a.mul_vec(&xi).to_vec();
    lp.load(a, &b, &vec![0.0; a.rows()]).unwrap();
    lp
}

fn signed(source: &mut Source) -> f64 {
    source.sym()
}

/// Entries in [−1, 1] with probability `density`, else 0.
fn sparse(rows: usize, cols: usize, density: f64, source: &mut Source) -> Matrix {
    Matrix::from_fn(rows, cols, |_, _| {
        let x = signed(source);
        if source.unit() < density { x } else { 0.0 }
    })
}

/// Entries −1, 0 and 1.
fn signs(rows: usize, cols: usize, density: f64, source: &mut Source) -> Matrix {
    let m = sparse(rows, cols, density, source);
    Matrix::from_fn(rows, cols, |i, j| match m[(i, j)] {
        0.0 => 0.0,
        x => x.signum(),
    })
}

/// `count` blocks of the shape along the diagonal.
fn blocks(count: usize, rows: usize, cols: usize, source: &mut Source) -> Matrix {
    let own = sparse(count * rows, cols, 1.0, source);
    Matrix::from_fn(count * rows, count * cols, |i, j| {
        if i / rows == j / cols {
            own[(i, j % cols)]
        } else {
            0.0
        }
    })
}

/// Pivots of the 2n programs ± G_j, each of which must end at its optimum, with a bound that interior points confirm.
fn pivots(g: &Matrix, a: &Matrix, source: &mut Source, confirm: bool) -> u64 {
    let mut lp = through(a, source);
    for j in 0..g.rows() {
        for sign in [1.0, -1.0] {
            let d: Vec<f64> = g.row(j).iter().map(|x| sign * x).collect();
            let found = lp.maximize(&d).unwrap();
            assert!(found.optimal);
            if confirm && sign > 0.0 && j % 5 == 0 {
                // The same multipliers must not be needed twice.
                let mut other = lp.clone();
                let second = other.maximize_by_interior_point(&d).unwrap();
                let room = 1e-6 * (1.0 + second.abs());
                assert!((found.upper - second).abs() <= room, "{found:?} {second}");
            }
        }
    }
    let work = lp.work();
    assert_eq!((work.unfinished, work.fallbacks), (0, 0), "{work:?}");
    work.pivots
}

#[test]
fn sparse_objectives_take_little_more_pivots_than_dense_ones() {
    let mut source = Source(21);
    let (n, q, p) = (30, 30, 120);
    let dense_rows = sparse(q, p, 1.0, &mut source);
    let dense = sparse(n, p, 1.0, &mut source);
    let reference = pivots(&dense, &dense_rows, &mut source, false);
    for density in [0.3, 0.1, 0.05] {
        let g = sparse(n, p, density, &mut source);
        let a = sparse(q, p, density, &mut source);
        for rows in [&dense_rows, &a] {
            let own = pivots(&g, rows, &mut source, true);
            // Up to 61 pivots a program pass before it is known to stall.
            assert!(own <= 2 * reference, "{density}: {own}, dense {reference}");
        }
    }
}

#[test]
fn signs_blocks_repeated_and_zero_objectives_end() {
    let mut source = Source(22);
    let (n, q, p) = (20, 20, 80);
    let cap = 2 * n as u64 * 200;
    for density in [1.0, 0.3, 0.1] {
        let (g, a) = (
            signs(n, p, density, &mut source),
            signs(q, p, density, &mut source),
        );
        let own = pivots(&g, &a, &mut source, true);
        assert!(own <= cap, "signs at {density}: {own}");
    }
    let (g, a) = (blocks(6, 4, 14, &mut source), blocks(6, 4, 14, &mut source));
    let own = pivots(&g, &a, &mut source, true);
    assert!(own <= 2 * 24 * 200, "blocks: {own}");
    // One coefficient alone, the same row again and again, and none.
    let single = Matrix::from_fn(n, p, |i, j| f64::from(j == 3 * i));
    let a = sparse(q, p, 1.0, &mut source);
    let row = sparse(1, p, 0.1, &mut source);
    let repeated = Matrix::from_fn(n, p, |_, j| row[(0, j)]);
    for g in [
        single,
        repeated,
        Matrix::zeros(n, p),
        Matrix::from_fn(n, p, |_, _| 1.0),
    ] {
        let own = pivots(&g, &a, &mut source, false);
        assert!(own <= cap, "{own}");
    }
}

#[test]
fn the_table_of_sparse_hulls_ends_with_nothing_given_up() {
    let mut source = Source(23);
    for (n, q, p, density, most) in [
        (12, 12, 40, 0.3, 40),
        (30, 30, 120, 0.1, 160),
        (60, 60, 240, 0.1, 320),
    ] {
        let (g, a) = (
            sparse(n, p, density, &mut source),
            sparse(q, p, density, &mut source),
        );
        let own = pivots(&g, &a, &mut source, false);
        assert!(own <= 2 * n as u64 * most, "{n}: {own}");
    }
}

#[test]
fn the_same_bits_twice_and_in_other_units() {
    let mut source = Source(24);
    let (g, a) = (
        sparse(30, 120, 0.1, &mut source),
        sparse(30, 120, 0.1, &mut source),
    );
    let mut lp = through(&a, &mut source);
    let mut other = lp.clone();
    for j in 0..30 {
        let d = g.row(j).to_vec();
        let own = lp.maximize(&d).unwrap();
        let scaled: Vec<f64> = d.iter().map(|x| x * 2.0_f64.powi(40)).collect();
        let found = other.maximize(&scaled).unwrap();
        assert_eq!(lp.point(), other.point());
        // The certificate's smallest number is of no size; else the bound is scaled exactly.
        let back = found.upper * 2.0_f64.powi(-40);
        assert!((back - own.upper).abs() <= 4.0 * f64::EPSILON * own.upper.abs());
    }
}

/// max dᵀx over A x ≤ b, 0 ≤ x ≤ 32, as a program over |ξ| ≤ 1; its bound.
fn standard(d: &[f64], a: &[&[f64]], b: &[f64]) -> (f64, LinearProgram) {
    const HALF: f64 = 16.0;
    let n = d.len();
    let rows = Matrix::from_fn(a.len(), n, |i, j| HALF * a[i][j]);
    // a x = HALF (Σ a + a ξ) lies between what the box allows and b.
    let ends: Vec<(f64, f64)> = a
        .iter()
        .zip(b)
        .map(|(row, &b)| {
            let middle: f64 = HALF * row.iter().sum::<f64>();
            let least = middle - HALF * row.iter().map(|x| x.abs()).sum::<f64>();
            (least - middle, b - middle)
        })
        .collect();
    let right: Vec<f64> = ends.iter().map(|(l, u)| 0.5 * (l + u)).collect();
    let slack: Vec<f64> = ends.iter().map(|(l, u)| 0.5 * (u - l)).collect();
    let mut lp = LinearProgram::new();
    lp.load(&rows, &right, &slack).unwrap();
    let scaled: Vec<f64> = d.iter().map(|x| HALF * x).collect();
    let upper = lp.maximize(&scaled).unwrap().upper;
    (upper + HALF * d.iter().sum::<f64>(), lp)
}

/// Both the program and its dual, min bᵀy over Aᵀy ≥ d, y ≥ 0, whose degeneracy is the other's.
fn both(d: &[f64], a: &[&[f64]], b: &[f64], value: f64) {
    let transposed: Vec<Vec<f64>> = (0..d.len())
        .map(|j| a.iter().map(|row| -row[j]).collect())
        .collect();
    let columns: Vec<&[f64]> = transposed.iter().map(Vec::as_slice).collect();
    let minus = |v: &[f64]| v.iter().map(|x| -x).collect::<Vec<f64>>();
    let (own, lp) = standard(d, a, b);
    let (dual, dual_lp) = standard(&minus(b), &columns, &minus(d));
    for (found, lp) in [(own, lp), (-dual, dual_lp)] {
        assert!((found - value).abs() <= 1e-9, "{found} {value}");
        let work = lp.work();
        assert_eq!((work.unfinished, work.fallbacks), (0, 0));
        assert!(work.pivots <= 30, "{work:?}");
    }
}

#[test]
fn the_cycling_examples_of_beale_kuhn_and_marshall_and_suurballe_end() {
    // Beale 1955: x = (1, 0, 1, 0).
    both(
        &[0.75, -20.0, 0.5, -6.0],
        &[
            &[0.25, -8.0, -1.0, 9.0],
            &[0.5, -12.0, -0.5, 3.0],
            &[0.0, 0.0, 1.0, 0.0],
        ],
        &[0.0, 0.0, 1.0],
        1.25,
    );
    // Kuhn: x = (2, 0, 2, 0).
    both(
        &[2.0, 3.0, -1.0, -12.0],
        &[
            &[-2.0, -9.0, 1.0, 9.0],
            &[1.0 / 3.0, 1.0, -1.0 / 3.0, -2.0],
            &[2.0, 3.0, -1.0, -12.0],
        ],
        &[0.0, 0.0, 2.0],
        2.0,
    );
    // Marshall and Suurballe 1969, bounded by x_1 ≤ 1.
    both(
        &[10.0, -57.0, -9.0, -24.0],
        &[
            &[0.5, -5.5, -2.5, 9.0],
            &[0.5, -1.5, -0.5, 1.0],
            &[1.0, 0.0, 0.0, 0.0],
        ],
        &[0.0, 0.0, 1.0],
        1.0,
    );
}
