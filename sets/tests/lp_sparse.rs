//! Large programs with few entries: taken apart, solved on an inverse of the basis, and no point cut off.
//!
//! The programs have small integers for A and y and eighths for a point ξ₀, and d = Aᵀy + v with v_j ξ₀_j = |v_j|. So b = A ξ₀
//! and dᵀξ₀ = bᵀy + ‖v‖₁ are exact, ξ₀ satisfies the rows exactly, and the maximum is exactly dᵀξ₀.

mod rational;

use rational::Source;
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::{Interval, IntervalVector, Matrix, SetError};

/// A program with a known maximum.
struct Case {
    a: Matrix,
    b: Vec<f64>,
    xi: Vec<f64>,
}

fn integer(source: &mut Source, most: f64) -> f64 {
    let x = (source.sym() * (most + 1.0)).trunc();
    if x == 0.0 { 1.0 } else { x }
}

fn chance(source: &mut Source, share: f64) -> bool {
    source.unit() < share
}

impl Case {
    /// Rows of `a` through a point of which a share `ends` of the coordinates is ±1.
    fn new(a: Matrix, ends: f64, source: &mut Source) -> Self {
        let xi: Vec<f64> = (0..a.cols())
            .map(|_| match chance(source, ends) {
                true => source.sym().signum(),
                false => (source.sym() * 7.9).trunc() / 8.0,
            })
            .collect();
        let b = a.mul_vec(&xi).into_vec();
        Self { a, b, xi }
    }

    fn sparse(rows: usize, cols: usize, density: f64, most: f64, source: &mut Source) -> Matrix {
        Matrix::from_fn(rows, cols, |_, _| {
            let x = integer(source, most);
            if chance(source, density) { x } else { 0.0 }
        })
    }

    fn load(&self) -> LinearProgram {
        let mut lp = LinearProgram::new();
        lp.load(&self.a, &self.b, &vec![0.0; self.b.len()]).unwrap();
        lp
    }

    /// A direction of which ξ₀ is a maximiser: a share `priced` of the rows has a multiplier, a share `costed` of the
    /// coordinates at their ends a cost of their own.
    fn direction(&self, priced: f64, costed: f64, source: &mut Source) -> (Vec<f64>, f64) {
        let mut d = vec![0.0; self.xi.len()];
        for i in 0..self.b.len() {
            if chance(source, priced) {
                let y = integer(source, 4.0);
                let row = self.a.row(i);
                d.iter_mut().zip(row).for_each(|(d, a)| *d += y * a);
            }
        }
        for (d, x) in d.iter_mut().zip(&self.xi) {
            if x.abs() == 1.0 && chance(source, costed) {
                *d += x * integer(source, 4.0).abs();
            }
        }
        let value = d.iter().zip(&self.xi).map(|(d, x)| d * x).sum();
        (d, value)
    }

    /// `count` directions: no bound is below its maximum, each is within a share of 1e-11 of the sizes, and all end within
    /// `most` pivots a program with none given up.
    fn holds(&self, name: &str, count: usize, most: f64, source: &mut Source) {
        let mut lp = self.load();
        for k in 0..count {
            let (priced, costed) =
                [(0.1, 0.5), (0.0, 0.1), (0.5, 0.0), (1.0, 1.0), (0.05, 0.0)][k % 5];
            let (d, value) = self.direction(priced, costed, source);
            let found = lp.maximize(&d).unwrap();
            let size: f64 = 1.0 + d.iter().map(|d| d.abs()).sum::<f64>();
            assert!(found.optimal, "{name} {k}");
            assert!(
                found.upper >= value,
                "{name} {k}: {} < {value}",
                found.upper
            );
            let excess = found.upper - value;
            assert!(excess <= 1e-10 * size, "{name} {k}: {excess:e} of {size}");
        }
        let work = lp.work();
        assert_eq!(
            (work.unfinished, work.fallbacks),
            (0, 0),
            "{name}: {work:?}"
        );
        let own = work.pivots as f64 / work.programs as f64;
        assert!(own <= most, "{name}: {own} pivots a program");
    }
}

#[test]
fn sparse_programs_cut_no_point_off_and_end_within_so_many_pivots() {
    let mut s = Source(31);
    for (q, p, density) in [
        (30, 120, 0.1),
        (60, 240, 0.1),
        (60, 240, 0.03),
        (100, 600, 0.02),
    ] {
        for most in [1.0, 3.0] {
            for ends in [0.9, 0.5, 1.0] {
                let a = Case::sparse(q, p, density, most, &mut s);
                let case = Case::new(a, ends, &mut s);
                let name = format!("{q} × {p} at {density}, entries to {most}, {ends} at an end");
                case.holds(&name, 20, 6.0 * q as f64, &mut s);
            }
        }
    }
}

#[test]
fn blocks_chains_and_bands_are_solved_apart_and_cut_no_point_off() {
    let mut s = Source(32);
    // Ten sets of (6, 20), their rows and columns mixed.
    let own = Case::sparse(60, 20, 1.0, 3.0, &mut s);
    let blocks = Matrix::from_fn(60, 200, |i, j| match i % 10 == j % 10 {
        true => own[(i, j / 10)],
        false => 0.0,
    });
    Case::new(blocks, 0.8, &mut s).holds("blocks", 40, 60.0, &mut s);
    // ξ_i − ξ_{i+1} + more on the right: rows that hang together.
    let chain = Matrix::from_fn(60, 180, |i, j| match j {
        _ if j == i || j == i + 60 => 1.0,
        _ if j == i + 1 => -1.0,
        _ if j == i + 120 => 2.0,
        _ => 0.0,
    });
    Case::new(chain, 0.8, &mut s).holds("chain", 40, 120.0, &mut s);
    let values = Case::sparse(60, 180, 1.0, 3.0, &mut s);
    let band = Matrix::from_fn(60, 180, |i, j| match (2 * i..2 * i + 8).contains(&j) {
        true => values[(i, j)],
        false => 0.0,
    });
    Case::new(band, 0.8, &mut s).holds("band", 40, 120.0, &mut s);
    // Columns in no row, and rows of zeros.
    let own = Case::sparse(50, 100, 0.08, 3.0, &mut s);
    let loose = Matrix::from_fn(70, 300, |i, j| match i < 50 && j < 100 {
        true => own[(i, j)],
        false => 0.0,
    });
    Case::new(loose, 0.8, &mut s).holds("loose", 20, 300.0, &mut s);
}

#[test]
fn rows_of_one_coefficient_and_what_they_fix_leave_and_their_multipliers_come_back() {
    let mut s = Source(33);
    for (single, chained) in [(20, 0), (10, 30), (40, 20)] {
        let (q, p) = (90, 200);
        let other = Case::sparse(q, p, 0.04, 3.0, &mut s);
        // Rows of one coefficient; rows that fix the next ξ once the one before is known; others.
        let a = Matrix::from_fn(q, p, |i, j| {
            if i < single {
                f64::from(j == 2 * i) * 2.0
            } else if i < single + chained {
                let k = i - single;
                f64::from(j == 100 + k) - f64::from(j == if k == 0 { 0 } else { 99 + k })
            } else {
                other[(i, j)]
            }
        });
        let case = Case::new(a, 0.7, &mut s);
        case.holds(
            &format!("{single} single, {chained} chained"),
            40,
            500.0,
            &mut s,
        );
        // The point found satisfies the rows.
        let mut lp = case.load();
        assert!(matches!(lp.emptiness(), Emptiness::NonEmpty(_)));
    }
}

#[test]
fn ranges_by_rows_of_one_coefficient_bound_both_ways() {
    let mut s = Source(34);
    let (q, p) = (60, 200);
    let other = Case::sparse(q, p, 0.04, 3.0, &mut s);
    let a = Matrix::from_fn(q, p, |i, j| match i < 30 {
        true => f64::from(j == i / 2) * if i % 2 == 0 { 1.0 } else { -2.0 },
        false => other[(i, j)],
    });
    let case = Case::new(a, 0.7, &mut s);
    // |ξ_j − ξ₀_j| ≤ 1/4 and |−2 ξ_j + 2 ξ₀_j| ≤ 1/4: the second is the narrower one.
    let delta: Vec<f64> = (0..q).map(|i| if i < 30 { 0.25 } else { 0.0 }).collect();
    let mut lp = LinearProgram::new();
    lp.load(&case.a, &case.b, &delta).unwrap();
    for j in 0..15 {
        for sign in [1.0, -1.0] {
            let mut d = vec![0.0; p];
            d[j] = sign;
            let end = (sign * case.xi[j] + 0.125).min(1.0);
            let found = lp.maximize(&d).unwrap();
            assert!(
                found.optimal && found.upper <= end + 1e-12,
                "{found:?} {end}"
            );
            assert!(found.upper >= sign * case.xi[j]);
        }
    }
    assert_eq!(lp.work().fallbacks, 0);
}

#[test]
fn a_contradiction_anywhere_is_a_proof_whatever_the_direction_concerns() {
    let mut s = Source(35);
    let own = Case::sparse(60, 20, 1.0, 3.0, &mut s);
    let blocks = Matrix::from_fn(60, 200, |i, j| match i % 10 == j % 10 {
        true => own[(i, j / 10)],
        false => 0.0,
    });
    let case = Case::new(blocks, 0.8, &mut s);
    let mut d = vec![0.0; 200];
    d[0] = 1.0;
    let mut lp = LinearProgram::new();
    // The last block has a row beyond all that its ξ reach.
    let mut b = case.b.clone();
    b[59] = 1.0 + case.a.row(59).iter().map(|a| a.abs()).sum::<f64>();
    lp.load(&case.a, &b, &[0.0; 60]).unwrap();
    assert!(matches!(lp.maximize(&d), Err(SetError::Empty { .. })));
    // Rows of one coefficient that contradict the box, each other, and a row of ξ that others fix.
    let pair = |changed: &[(usize, usize, f64)], b: &[(usize, f64)]| {
        let mut a = Matrix::zeros(60, 200);
        for i in 0..60 {
            a[(i, i)] = 2.0;
        }
        for &(i, j, x) in changed {
            a[(i, j)] = x;
        }
        let mut right = vec![0.5; 60];
        b.iter().for_each(|&(i, x)| right[i] = x);
        let mut lp = LinearProgram::new();
        lp.load(&a, &right, &[0.0; 60]).unwrap();
        (lp.emptiness(), lp.maximize(&vec![1.0; 200]).is_err())
    };
    assert_eq!(pair(&[], &[(7, 2.5)]), (Emptiness::Empty, true));
    assert_eq!(
        pair(&[(8, 8, 0.0), (8, 7, 1.0)], &[(8, -0.5)]),
        (Emptiness::Empty, true)
    );
    assert_eq!(
        pair(&[(9, 8, 1.0), (9, 9, 0.0), (9, 7, 1.0)], &[]),
        (Emptiness::NonEmpty(point(9)), false)
    );
    assert_eq!(
        pair(&[(9, 8, 1.0), (9, 9, 0.0), (9, 7, 1.0)], &[(9, 0.75)]),
        (Emptiness::Empty, true)
    );
}

/// ξ = ¼ on the first 60 coordinates; those in no row, and coordinate `free`, where the direction of a search leaves them.
fn point(free: usize) -> zonobench_sets::List<f64> {
    let end = |j: usize| if (j * 37 + 11) % 64 < 32 { -1.0 } else { 1.0 };
    (0..200)
        .map(|j| if j < 60 && j != free { 0.25 } else { end(j) })
        .collect()
}

#[test]
fn nearly_dependent_sparse_rows_keep_their_bounds() {
    let mut s = Source(36);
    for nearness in [10, 20, 40] {
        let own = Case::sparse(30, 200, 0.05, 3.0, &mut s);
        let little = 1.0 / (1_u64 << nearness) as f64;
        // Every row twice, one entry of the copy a little more.
        let a = Matrix::from_fn(60, 200, |i, j| {
            own[(i / 2, j)] + if i % 2 == 1 && j == i { little } else { 0.0 }
        });
        let case = Case::new(a, 0.9, &mut s);
        let mut lp = case.load();
        for _ in 0..20 {
            let (d, value) = case.direction(0.0, 0.5, &mut s);
            let found = lp.maximize(&d).unwrap();
            assert!(found.upper >= value, "{} < {value}", found.upper);
        }
        let work = lp.work();
        assert!(work.pivots <= 60 * 20 * 20, "{nearness}: {work:?}");
        // Rows that differ by 1e-6 make of a rounding of 1e-16 more than the tolerance of 1e-11 at times.
        assert!(work.unfinished <= 4, "{nearness}: {work:?}");
    }
}

#[test]
fn hulls_of_a_product_are_the_hulls_of_its_sets() {
    use zonobench_sets::ConstrainedZonotope;
    let mut s = Source(37);
    let sets: Vec<ConstrainedZonotope> = (0..8)
        .map(|_| {
            let g = Matrix::from_fn(4, 14, |_, _| s.sym());
            let a = Matrix::from_fn(4, 14, |_, _| s.sym());
            let xi: Vec<f64> = (0..14).map(|_| s.sym()).collect();
            let b = a.mul_vec(&xi);
            ConstrainedZonotope::new(vec![0.0; 4], g, a, b).unwrap()
        })
        .collect();
    let product = sets[1..]
        .iter()
        .fold(sets[0].clone(), |p, set| p.cartesian_product(set));
    let mut lp = LinearProgram::new();
    let hull = product.interval_hull_with(&mut lp).unwrap();
    let apart: Vec<IntervalVector> = sets
        .iter()
        .map(|set| set.interval_hull().unwrap())
        .collect();
    let apart: Vec<Interval> = apart.iter().flat_map(|hull| hull.iter().copied()).collect();
    for (own, other) in hull.iter().zip(&apart) {
        assert!((own.hi() - other.hi()).abs() <= 1e-11 && (own.lo() - other.lo()).abs() <= 1e-11);
    }
    // Each direction concerns one set of eight; as many pivots as the sets have by themselves, and theirs once more to
    // know that none is empty.
    let alone: u64 = sets
        .iter()
        .map(|set| {
            let mut lp = LinearProgram::new();
            set.interval_hull_with(&mut lp).unwrap();
            lp.work().pivots
        })
        .sum();
    assert!(lp.work().pivots <= 2 * alone, "{:?} {alone}", lp.work());
}
