//! What this library takes.

use crate::plain;
use crate::sets::{Case, NOISE, Size, cube, off};
use crate::timing::{Row, Times, time};
use std::hint::black_box;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::Function;
use zonobench_sets::reduction::{combastel, scott};
use zonobench_sets::{ConstrainedZonotope, Interval, IntervalVector, Matrix, Real, Zonotope};

fn row(operation: &'static str, size: Size, times: Times, remark: &'static str) -> Row {
    Row {
        tool: "zonobench",
        version: env!("CARGO_PKG_VERSION"),
        operation,
        size,
        times,
        hulls: Vec::new(),
        remark,
    }
}

/// (upper, lower) a state.
fn sides(hull: &IntervalVector) -> Vec<[f64; 2]> {
    hull.iter().map(|side| [side.hi(), side.lo()]).collect()
}

/// X ∩_R (y + V), reduced to the order of the size.
fn cut(set: &ConstrainedZonotope, case: &Case, y: &[f64], size: Size) -> ConstrainedZonotope {
    let seen = cube(y.to_vec(), NOISE[1]);
    let joined = set
        .generalized_intersection(&case.output, &seen)
        .expect("the shapes fit");
    scott::reduce(&joined.fold(), size.p, size.q).expect("the set has a point")
}

/// A linear estimator's step: (M X ⊕ W) ∩_R (y + V), reduced.
fn step(case: &Case, size: Size) -> ConstrainedZonotope {
    let image = case.set.linear_map(&case.map).expect("the shapes fit");
    let predicted = image
        .minkowski_sum(&cube(vec![0.0; size.n], NOISE[0]))
        .expect("the shapes fit");
    cut(&predicted, case, &case.y[1], size)
}

pub fn measure(size: Size, cases: &[Case]) {
    let mut lp = LinearProgram::new();
    let each = cases.len();
    let mut hull = |set: &ConstrainedZonotope| {
        set.interval_hull_with(&mut lp)
            .expect("the set has a point")
    };
    let times = time(each, || {
        for case in cases {
            black_box(hull(&case.set));
        }
    });
    let hulls = cases
        .iter()
        .map(|case| off(&sides(&hull(&case.set)), &case.ends))
        .collect();
    let certified = "2n programs; every end certified";
    println!(
        "{}",
        Row {
            hulls,
            ..row("interval hull", size, times, certified)
        }
    );

    let times = time(each, || {
        for case in cases {
            black_box(
                case.set
                    .support_with(&case.direction, &mut lp)
                    .expect("the set has a point"),
            );
        }
    });
    println!("{}", row("support", size, times, "certified"));
    let times = certificates(cases);
    println!(
        "{}",
        row(
            "certificates of a hull",
            size,
            times,
            "what of the hull is certifying it"
        )
    );

    let times = time(each, || {
        for case in cases {
            black_box(cut(&case.set, case, &case.y[0], size));
        }
    });
    let reduced = "constraints and generators";
    println!(
        "{}",
        row("intersection and reduction", size, times, reduced)
    );
    let times = time(each, || {
        for case in cases {
            black_box(step(case, size));
        }
    });
    println!("{}", row("step", size, times, reduced));
    let times = time(each, || {
        for case in cases {
            black_box(
                step(case, size)
                    .interval_hull_with(&mut lp)
                    .expect("the set has a point"),
            );
        }
    });
    println!("{}", row("step and hull", size, times, reduced));
}

/// The bound of every side of the hull, from multipliers that are there.
fn certificates(cases: &[Case]) -> Times {
    let mut programs: Vec<(LinearProgram, Vec<f64>, &Case)> = cases
        .iter()
        .map(|case| {
            let mut lp = LinearProgram::new();
            lp.load(case.set.a(), case.set.b(), case.set.delta())
                .expect("the rows are finite");
            lp.maximize(case.set.g().row(0))
                .expect("the set has a point");
            let y = lp.multipliers();
            (lp, y, case)
        })
        .collect();
    time(cases.len(), || {
        for (lp, y, case) in &mut programs {
            for j in 0..case.set.dim() {
                let row = case.set.g().row(j);
                let minus: Vec<f64> = row.iter().map(|g| -g).collect();
                black_box(lp.bound_by(row, y).expect("the shapes fit"));
                black_box(lp.bound_by(&minus, y).expect("the shapes fit"));
            }
        }
    })
}

/// f₁ = 3 x₁ − x₁²/7 − 4 x₁ x₂/(4 + x₁) of [Rego2020, Eq. (23)], with x₁/(4 + x₁) = 1 − 4/(4 + x₁).
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

/// What needs no program: a function over a box, the box of a zonotope.
pub fn closed_forms(size: Size, cases: &[Case]) {
    let interval = |lo, hi| Interval::new(lo, hi).expect("the ends are ordered");
    let over = [interval(2.0, 2.4), interval(0.9, 1.1)];
    if size.n == 2 && size.p == 20 {
        // A thousand a pass: one takes less than the clock can tell.
        let times = time(1000, || {
            let mut y = [Interval::ZERO];
            for _ in 0..1000 {
                Growth.evaluate(black_box(&over), &mut y);
                black_box(y);
            }
        });
        println!(
            "{}",
            row(
                "f1 over a box",
                Size { p: 0, q: 0, ..size },
                times,
                "outward rounded"
            )
        );
    }
    let size = Size { q: 0, ..size };
    let times = time(cases.len(), || {
        for case in cases {
            black_box(
                case.set
                    .zonotope()
                    .interval_hull()
                    .expect("the entries are finite"),
            );
        }
    });
    println!(
        "{}",
        row("box of a zonotope", size, times, "outward rounded")
    );
}

/// A zonotope filter's step, with its rounding and without: M X ⊕ W, an update by a gain, Combastel's reduction.
pub fn zonotope_steps(size: Size, cases: &[Case]) {
    let size = Size { q: 0, ..size };
    let w = Zonotope::new(vec![0.0; size.n], Matrix::identity(size.n).scale(NOISE[0]))
        .expect("the shapes fit");
    let seen = Matrix::identity(size.outputs).scale(NOISE[1]);
    let v = Zonotope::new(vec![0.0; size.outputs], seen).expect("the shapes fit");
    let gains: Vec<Matrix> = cases
        .iter()
        .map(|case| case.output.transpose().scale(0.125))
        .collect();
    let times = time(cases.len(), || {
        for (case, gain) in cases.iter().zip(&gains) {
            let image = case
                .set
                .zonotope()
                .linear_map(&case.map)
                .expect("the shapes fit");
            let predicted = image.minkowski_sum(&w).expect("the shapes fit");
            let updated = predicted
                .update(gain, &case.output, &case.y[1], &v)
                .expect("the shapes fit");
            black_box(combastel::reduce(&updated.fold(), size.p).expect("the order is enough"));
        }
    });
    println!(
        "{}",
        row("zonotope step", size, times, "rounding in the set")
    );
    let times = time(cases.len(), || {
        for (case, gain) in cases.iter().zip(&gains) {
            let set = (case.set.c(), case.set.g());
            black_box(plain::zonotope_step(
                set,
                &case.map,
                w.g(),
                gain,
                &case.output,
                &case.y[1],
                v.g(),
                size.p,
            ));
        }
    });
    println!(
        "{}",
        Row {
            tool: "plain f64",
            ..row("zonotope step", size, times, "no rounding is bounded")
        }
    );
}
