//! The cost of intervals and of derivatives over them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use zonobench_sets::number::{Function, hessian, jacobian};
use zonobench_sets::{Interval, Real};

/// f₁ = 3 x₁ − x₁²/7 − 4 x₁ x₂/(4 + x₁) + w₁ of [Rego2020, Eq. (23)] with x₁/(4 + x₁) = 1 − 4/(4 + x₁).
struct Growth;

impl Function for Growth {
    fn inputs(&self) -> usize {
        2
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        let saturation = (x[0] + 4.0).recip() * 4.0;
        y[0] = x[0] * 3.0 - x[0].sqr() / 7.0 - x[1] * 4.0 * (-saturation + 1.0);
    }
}

/// 1024 pairs with all signs in the first argument; the second does not contain 0.
fn pairs() -> Vec<(Interval, Interval)> {
    let interval = |lo, hi| Interval::new(lo, hi).expect("the bounds are ordered");
    let pair = |i: u32| {
        let t = f64::from(i.wrapping_mul(2_654_435_761) >> 12) / f64::from(1 << 20);
        let sign = if i.is_multiple_of(3) { -1.0 } else { 1.0 };
        let b = sign * (0.1 + t);
        (
            interval(2.0 * t - 1.5, 2.0 * t - 1.0),
            interval(b - 0.01, b + 0.01),
        )
    };
    (0..1024).map(pair).collect()
}

fn operations(c: &mut Criterion) {
    let pairs = pairs();
    let mut group = c.benchmark_group("interval, 1024 operations");
    group.throughput(Throughput::Elements(1024));
    let mut operation = |name: &str, f: fn(Interval, Interval) -> Interval| {
        group.bench_function(name, |bench| {
            let mut out = vec![Interval::ZERO; pairs.len()];
            bench.iter(|| {
                for (o, &(a, b)) in out.iter_mut().zip(black_box(&pairs)) {
                    *o = f(a, b);
                }
                black_box(&out);
            });
        });
    };
    operation("add", |a, b| a + b);
    operation("mul", |a, b| a * b);
    operation("div", |a, b| a / b);
    operation("sqr", |a, _| a.sqr());
    operation("sqrt", |a, _| a.abs().sqrt());
    operation("sin", |a, _| a.sin());
    operation("atan", |a, _| a.atan());
}

fn derivatives(c: &mut Criterion) {
    let interval = |lo, hi| Interval::new(lo, hi).expect("the bounds are ordered");
    let over = [interval(2.0, 2.4), interval(0.9, 1.1)];
    let at = [2.2, 1.0];
    let mut group = c.benchmark_group("f1");
    group.bench_function("value f64", |b| {
        let mut y = [0.0];
        b.iter(|| {
            Growth.evaluate(black_box(&at), &mut y);
            y[0]
        });
    });
    group.bench_function("value interval", |b| {
        let mut y = [Interval::ZERO];
        b.iter(|| {
            Growth.evaluate(black_box(&over), &mut y);
            y[0]
        });
    });
    group.bench_function("Jacobian f64", |b| {
        b.iter(|| jacobian(&Growth, black_box(&at)))
    });
    group.bench_function("Jacobian interval", |b| {
        b.iter(|| jacobian(&Growth, black_box(&over)))
    });
    group.bench_function("Hessian f64", |b| {
        b.iter(|| hessian(&Growth, black_box(&at)))
    });
    group.bench_function("Hessian interval", |b| {
        b.iter(|| hessian(&Growth, black_box(&over)))
    });
    group.finish();
}

criterion_group!(benches, operations, derivatives);
criterion_main!(benches);
