//! [Rego2020, Table 7]: the cost of the operations that the estimators are made of.

use crate::claim::{Row, Sweep, TOLERANCE, judge, rows as rows_of};
use crate::cz::{Sizes, modelled, priced};
use crate::instance::Instance;
use zonobench_estimation::propagation::{closest_point, coordinates_of};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::ops::{self, Tally};
use zonobench_sets::reduction::{scott, yang_scott};
use zonobench_sets::{Interval, IntervalMatrix};

const VALID: &str = "the instance is a valid one";

/// An operation of the table: its claim, the printed formula in n = n_r = n_s, n_g and n_c, and the
/// operation on sets of these sizes. Half of what generators there are above the least go in a reduction.
struct Operation {
    claim: &'static str,
    formula: fn(f64, f64, f64) -> f64,
    run: fn(&Sizes, &mut Instance) -> Tally,
}

/// The least generators that a reduction of dimension `rows` leaves, and those that go.
fn kept(n_g: usize, rows: usize) -> usize {
    rows + (n_g - rows) / 2
}

const OPERATIONS: [Operation; 14] = [
    Operation {
        claim: "cz-zonotope-linear-image",
        formula: |n, g, _| n * g * n,
        run: |s, draw| {
            let (z, r) = (draw.zonotope(s.n, s.n_g, 0.1), draw.matrix(s.n, s.n, 1.0));
            ops::tally(|| z.linear_map(&r).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-linear-image",
        formula: |n, g, _| n * g * n,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let r = draw.matrix(s.n, s.n, 1.0);
            ops::tally(|| x.affine_map(&r, &vec![0.0; s.n]).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-zonotope-minkowski-sum",
        formula: |n, _, _| n,
        run: |s, draw| {
            let (z, w) = (draw.zonotope(s.n, s.n_g, 0.1), draw.zonotope(s.n, s.n, 0.1));
            ops::tally(|| z.minkowski_sum(&w).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-minkowski-sum",
        formula: |n, _, _| n,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let w = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            ops::tally(|| x.minkowski_sum(&w).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-generalized-intersection",
        formula: |n, g, _| n * g * n + n * n,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let (r, y) = (draw.matrix(s.n, s.n, 1.0), draw.zonotope(s.n, s.n, 0.1));
            ops::tally(|| x.generalized_intersection(&r, &y.into()).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-zonotope-interval-hull",
        formula: |n, g, _| n * g,
        run: |s, draw| {
            let z = draw.zonotope(s.n, s.n_g, 0.1);
            ops::tally(|| z.interval_hull().expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-interval-hull",
        formula: |n, g, c| n * g * cube(g + c),
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            ops::tally(|| x.interval_hull().expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-zonotope-set-inclusion",
        formula: |n, g, _| n * g,
        run: |s, draw| {
            let (z, j) = (draw.zonotope(s.n, s.n_g, 0.1), jacobian(s.n, draw));
            ops::tally(|| z.interval_map(&j).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-set-inclusion",
        formula: |n, g, c| n * n * g + c * cube(g + c) + n * g * g * c,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let j = jacobian(s.n, draw);
            let work = || {
                let free = scott::eliminate_constraints(&x, 0).expect(VALID);
                let radius = j.rad().mul_vec(&free.zonotope().radius());
                let image = x.affine_map(&j.mid(), &vec![0.0; s.n]).expect(VALID);
                image.plus_box(&radius).expect(VALID)
            };
            ops::tally(work).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-closest-point",
        formula: |n, g, c| (n + g) * cube(n + g + c),
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let p = draw.vector(s.n, 1.0);
            let work = || closest_point(&x, &p, None, &mut LinearProgram::new()).expect(VALID);
            ops::tally(work).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-change-center",
        formula: |n, g, c| g * cube(n + g) + g * g * c,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let h: Vec<f64> = x.c().iter().map(|c| c + 0.01).collect();
            let work = || {
                let ranges = scott::coordinate_bounds(&x).expect(VALID);
                let mut lp = LinearProgram::new();
                let m = coordinates_of(&x, &h, &ranges, &mut lp).expect(VALID);
                scott::recentred(&x, &m).expect(VALID)
            };
            ops::tally(work).1
        },
    },
    Operation {
        claim: "cz-zonotope-generator-reduction",
        formula: |n, g, _| n * n * g + (g - n) / 2.0 * n * g,
        run: |s, draw| {
            let z = draw.zonotope(s.n, s.n_g, 0.1);
            ops::tally(|| yang_scott::reduce(&z, kept(s.n_g, s.n)).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-generator-reduction",
        formula: |n, g, c| (n + c) * (n + c) * g + (g - n - c) / 2.0 * (n + c) * g,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let generators = kept(s.n_g, s.n + s.n_c);
            ops::tally(|| scott::reduce_generators(&x, generators).expect(VALID)).1
        },
    },
    Operation {
        claim: "cz-constrained-zonotope-constraint-elimination",
        formula: |n, g, c| c * cube(g + c) + c * n * g * g,
        run: |s, draw| {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            ops::tally(|| scott::eliminate_constraints(&x, 0).expect(VALID)).1
        },
    },
];

fn cube(x: f64) -> f64 {
    x * x * x
}

/// A random interval matrix, every entry with a radius.
fn jacobian(n: usize, draw: &mut Instance) -> IntervalMatrix {
    let mid = draw.matrix(n, n, 1.0);
    IntervalMatrix::from_fn(n, n, |i, j| Interval::from_center_radius(mid[(i, j)], 0.1))
}

/// The rows of the table, under the paper's prices of programs and eliminations.
///
/// Sizes in proportion: n = n_r = n_s = n_c = 2 s and n_g = 6 s, so that halves are whole.
pub fn rows() -> Vec<Row> {
    let mut out = Vec::new();
    for operation in OPERATIONS {
        let runs: Vec<(i64, Tally, f64)> = (1..=9)
            .map(|s| {
                let sizes = Sizes::all(2 * s);
                let tally = (operation.run)(&sizes, &mut Instance::new(4 << 40 | s as u64));
                let [n, g, c] = [sizes.n, sizes.n_g, sizes.n_c].map(|x| x as f64);
                (s as i64, tally, (operation.formula)(n, g, c))
            })
            .collect();
        let sweep = |count: &dyn Fn(&Tally) -> f64| {
            let points = runs.iter().map(|(s, t, formula)| (*s, count(t), *formula));
            Sweep::new("all", points.collect())
        };
        let mut under_model = sweep(&modelled);
        let (model, rest) = (sweep(&priced), sweep(&|t| modelled(t) - priced(t)));
        if model.degree.is_exact() && rest.degree.value < model.degree.value + TOLERANCE {
            under_model.degree = model.degree;
        }
        let (verdict, reason) = judge(std::slice::from_ref(&under_model));
        out.extend(rows_of(operation.claim, &[under_model], verdict, reason));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Verdict;

    #[test]
    fn every_operation_is_counted_and_only_the_inclusion_of_a_zonotope_costs_more_than_printed() {
        for row in rows().iter().filter(|r| r.sweep_variable.is_empty()) {
            let denied = row.claim == "cz-zonotope-set-inclusion";
            assert_eq!(row.verdict == Verdict::DoesNotHold, denied, "{row:?}");
        }
    }
}
