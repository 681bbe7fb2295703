//! Operations on zonotopes at the sizes (n, p) that the papers use.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zonobench_sets::matrix::dot;
use zonobench_sets::ops;
use zonobench_sets::reduction::{combastel, girard, parallel};
use zonobench_sets::{Matrix, Zonotope};

fn zonotope(n: usize, p: usize) -> Zonotope {
    // Weyl sequences: spread evenly, and no two columns alike.
    let entry =
        |i: usize, j: usize| ((j + 1) as f64 * (0.618_033_988_75 + 0.137 * i as f64)).fract() - 0.5;
    Zonotope::new(vec![1.0; n], Matrix::from_fn(n, p, entry)).expect("entries are finite")
}

fn operations(criterion: &mut Criterion) {
    for (n, p, reduced) in [
        (2, 100, 60),
        (2, 8004, 4000),
        (2, 12_000, 4000),
        (12, 100, 60),
    ] {
        let z = zonotope(n, p);
        let noise = zonotope(n, n);
        let m = Matrix::from_fn(n, n, |i, j| 1.0 / (1 + i + 2 * j) as f64);
        let mut group = criterion.benchmark_group(format!("n{n}_p{p}"));
        group.bench_function("linear_map", |b| b.iter(|| black_box(&z).linear_map(&m)));
        group.bench_function("minkowski_sum", |b| {
            b.iter(|| black_box(&z).minkowski_sum(&noise))
        });
        group.bench_function("interval_hull", |b| {
            b.iter(|| black_box(&z).interval_hull())
        });
        group.bench_function("combastel", |b| {
            b.iter(|| combastel::reduce(black_box(&z), reduced))
        });
        group.bench_function("combastel_columns", |b| {
            b.iter(|| combastel::reduce_columns(black_box(z.g()), reduced));
        });
        group.bench_function("girard", |b| {
            b.iter(|| girard::reduce(black_box(&z), reduced))
        });
        group.bench_function("merge_parallel", |b| {
            b.iter(|| parallel::merge(black_box(&z), 0.0))
        });
        if n == 2 {
            group.bench_function("area", |b| b.iter(|| black_box(&z).volume()));
        }
        group.finish();
    }
}

/// A kernel with the tally off beside the loops alone, which look at no flag, and with the tally on.
fn tally(criterion: &mut Criterion) {
    for n in [2, 12] {
        let m = Matrix::from_fn(n, n, |i, j| 1.0 / (1 + i + 2 * j) as f64);
        let mut group = criterion.benchmark_group(format!("tally_gram_{n}"));
        group.bench_function("loops", |b| {
            b.iter(|| {
                let m = black_box(&m);
                let mut out = Matrix::zeros(n, n);
                for i in 0..n {
                    for j in 0..=i {
                        let s = dot(m.row(i), m.row(j));
                        out[(i, j)] = s;
                        out[(j, i)] = s;
                    }
                }
                out
            });
        });
        group.bench_function("off", |b| b.iter(|| black_box(&m).gram()));
        group.bench_function("on", |b| {
            ops::tally(|| b.iter(|| black_box(&m).gram()));
        });
    }
}

criterion_group!(benches, operations, tally);
criterion_main!(benches);
