//! Certified interval hulls (2n programs over one warm engine) beside clarabel, what the certificate
//! costs, and a measurement step with its reduction.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

/// Uniform numbers in [−1, 1) from a seed.
struct Source(u64);

impl Source {
    fn sym(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Roughly normal.
    fn normal(&mut self) -> f64 {
        (0..6).map(|_| self.sym()).sum::<f64>() * std::f64::consts::FRAC_1_SQRT_2
    }
}

struct Case {
    g: Matrix,
    minus: Matrix,
    a: Matrix,
    b: Vec<f64>,
    delta: Vec<f64>,
}

fn cases(n: usize, rows: usize, cols: usize) -> Vec<Case> {
    let mut s = Source(7);
    let cases = (0..20).map(|_| {
        let g = Matrix::from_fn(n, cols, |_, _| s.normal());
        let a = Matrix::from_fn(rows, cols, |_, _| s.normal());
        let inside: Vec<f64> = (0..cols).map(|_| s.sym()).collect();
        let b = a.mul_vec(&inside).into_vec();
        Case {
            minus: g.scale(-1.0),
            g,
            a,
            b,
            delta: vec![0.0; rows],
        }
    });
    cases.collect()
}

fn hull(lp: &mut LinearProgram, case: &Case) -> f64 {
    lp.load(&case.a, &case.b, &case.delta)
        .expect("the case is finite");
    let mut total = 0.0;
    for j in 0..case.g.rows() {
        total += lp
            .maximize(case.g.row(j))
            .expect("the case is feasible")
            .upper;
        total += lp
            .maximize(case.minus.row(j))
            .expect("the case is feasible")
            .upper;
    }
    total
}

/// The same hull by the interior-point solver through the same certificate: the yardstick.
fn hull_by_interior_point(lp: &mut LinearProgram, case: &Case) -> f64 {
    lp.load(&case.a, &case.b, &case.delta)
        .expect("the case is finite");
    let mut total = 0.0;
    for j in 0..case.g.rows() {
        for row in [case.g.row(j), case.minus.row(j)] {
            total += lp
                .maximize_by_interior_point(row)
                .expect("the case is feasible");
        }
    }
    total
}

const SIZES: [(usize, usize, usize); 4] = [(2, 5, 20), (12, 12, 40), (12, 24, 90), (30, 30, 120)];

fn interval_hull(c: &mut Criterion) {
    let mut group = c.benchmark_group("interval hull");
    for (n, rows, cols) in SIZES {
        let cases = cases(n, rows, cols);
        let mut lp = LinearProgram::new();
        for case in &cases {
            hull(&mut lp, case);
        }
        let work = lp.work();
        println!(
            "({n}, {rows}, {cols}): {:.2} pivots a program, {work:?}",
            work.pivots as f64 / work.programs as f64
        );
        let mut next = 0;
        group.bench_function(format!("{n},{rows},{cols}"), |b| {
            b.iter(|| {
                next = (next + 1) % cases.len();
                black_box(hull(&mut lp, &cases[next]))
            });
        });
        group.bench_function(format!("{n},{rows},{cols} by clarabel"), |b| {
            b.iter(|| {
                next = (next + 1) % cases.len();
                black_box(hull_by_interior_point(&mut lp, &cases[next]))
            });
        });
    }
    group.finish();
}

/// What certifying costs: the bound of all 2n programs of a hull from multipliers that are there.
fn certificate(c: &mut Criterion) {
    let mut group = c.benchmark_group("certificates of a hull");
    for (n, rows, cols) in SIZES {
        let case = &cases(n, rows, cols)[0];
        let mut lp = LinearProgram::new();
        lp.load(&case.a, &case.b, &case.delta)
            .expect("the case is finite");
        lp.maximize(case.g.row(0)).expect("the case is feasible");
        let y = lp.multipliers();
        group.bench_function(format!("{n},{rows},{cols}"), |b| {
            b.iter(|| {
                let mut total = 0.0;
                for j in 0..n {
                    for row in [case.g.row(j), case.minus.row(j)] {
                        total += lp.bound_by(row, &y).expect("shapes fit");
                    }
                }
                black_box(total)
            });
        });
    }
    group.finish();
}

/// A measurement of two components and the reduction back to (generators, constraints).
fn intersection_and_reduction(c: &mut Criterion) {
    let mut group = c.benchmark_group("intersection and reduction");
    for (n, rows, cols, outputs) in [(2, 5, 20, 2), (12, 12, 40, 9)] {
        let case = &cases(n, rows, cols)[0];
        let mut s = Source(3);
        let output = Matrix::from_fn(outputs, n, |_, _| s.normal());
        let set =
            ConstrainedZonotope::new(vec![0.0; n], case.g.clone(), case.a.clone(), case.b.clone());
        let set = set.expect("shapes fit");
        let y = set
            .linear_map(&output)
            .expect("shapes fit")
            .interval_hull()
            .expect("the set has a point")
            .mid();
        let noise = Zonotope::new(y, Matrix::identity(outputs))
            .expect("shapes fit")
            .into();
        group.bench_function(format!("{n},{rows},{cols} with {outputs}"), |b| {
            b.iter(|| {
                let joined = set
                    .generalized_intersection(&output, &noise)
                    .expect("shapes fit");
                black_box(scott::reduce(&joined.fold(), cols, rows).expect("the set has a point"))
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(30).measurement_time(std::time::Duration::from_secs(2)).warm_up_time(std::time::Duration::from_millis(500));
    targets = interval_hull, certificate, intersection_and_reduction
}
criterion_main!(benches);
