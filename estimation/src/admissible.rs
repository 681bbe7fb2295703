//! Whether a truth keeps to what an estimator assumes.
//!
//! A guarantee holds under its assumptions. An experiment may break them on purpose (outliers, another
//! prior); then a lost truth is a result and no violation. This says, from the truth's description alone, whether every
//! draw lies in the assumed sets: true where that is certain.
//!
//! One thing is not proved of it: that the rounding of y_k to an f64 leaves v_k in its set. Noise keeps a share of 10⁻¹² of its
//! bounds free for that ([`INSIDE`]), which is more than u |y_k| as long as |y_k| is below 9000 half-widths of v_k.

use crate::signal::sum_at;
use crate::simulate::{INSIDE, InitialState, Law, Noise};
use crate::system::System;
use crate::{Problem, Truth, Uncertain};
use zonobench_sets::zonotope::Zonotope;
use zonobench_sets::{Containment, Interval};

impl Truth {
    /// True if x_0, and w and v up to step `steps`, lie in the sets of `problem` in every run.
    ///
    /// False where that cannot be seen: a Gaussian that is not truncated, a set that is not the assumed one
    /// and whose hull does not fit into an assumed box, a measurement assumed to be exact.
    pub fn is_admissible<Y: System>(&self, problem: &Problem<Y>, steps: usize) -> bool {
        let start = match &self.x0 {
            InitialState::Point(x) => holds_point(&problem.prior, x),
            InitialState::Drawn(of) => of.has_set() && fits(of, &problem.prior),
        };
        let bounded_delta = problem.system.n_delta() == 0 || self.delta.is_some();
        // y_k is rounded to an f64: only noise of some width can stand for that.
        let rounding_fits = problem
            .v
            .box_hull()
            .iter()
            .all(|side| side.lo() < side.hi());
        start
            && bounded_delta
            && rounding_fits
            && noise_fits(&self.w, &problem.w, steps)
            && noise_fits(&self.v, &problem.v, steps + 1)
    }
}

/// Whether the set of `inner` is that of `outer`, or its hull lies in the box of `outer`.
fn fits(inner: &Uncertain, outer: &Uncertain) -> bool {
    let same = inner.center == outer.center
        && inner.generators == outer.generators
        && inner.constraints == outer.constraints;
    let boxed = outer.constraints.is_none()
        && outer.bounds.as_ref().is_some_and(|sides| {
            let hull = inner.box_hull();
            (0..sides.dim()).all(|i| hull[i].is_subset(sides[i]))
        });
    (same && outer.has_set()) || boxed
}

fn holds_point(set: &Uncertain, x: &[f64]) -> bool {
    if set.constraints.is_some() {
        return false;
    }
    if let Some(sides) = &set.bounds {
        return sides.contains(x);
    }
    let point: Vec<Interval> = x.iter().map(|&x| Interval::point(x)).collect();
    set.has_set()
        && Zonotope::new(set.center.clone(), set.generator_matrix())
            .and_then(|z| z.contains(&point))
            .is_ok_and(|answer| answer == Containment::Inside)
}

fn noise_fits(noise: &Noise, assumed: &Uncertain, steps: usize) -> bool {
    let zero = vec![0.0; assumed.dim()];
    match noise {
        Noise::Drawn(drawn) => match drawn.law {
            Law::Zero => {
                !assumed.has_set() && zero == assumed.center || holds_point(assumed, &zero)
            }
            Law::Uniform | Law::Vertices => fits(&drawn.of, assumed),
            Law::Gaussian => drawn.truncate && fits(&drawn.of, assumed),
            Law::Mixed => false,
        },
        Noise::Signals { terms, about } => {
            let values = terms
                .iter()
                .map(|t| (0..steps).map(|k| sum_at(t, k)).collect());
            signals_fit(values.collect(), about.as_deref(), assumed)
        }
        Noise::Alternatives {
            alternatives,
            about,
        } => {
            let values = alternatives.iter().map(|choices| {
                choices
                    .iter()
                    .flat_map(|t| (0..steps).map(|k| sum_at(t, k)))
                    .collect()
            });
            signals_fit(values.collect(), about.as_deref(), assumed)
        }
        Noise::Data(rows) => rows.iter().all(|row| holds_point(assumed, row)),
    }
}

/// Whether every value of every component lies in the assumed box, after the draw towards its center.
fn signals_fit(values: Vec<Vec<f64>>, about: Option<&[f64]>, assumed: &Uncertain) -> bool {
    let Some(sides) = assumed
        .bounds
        .as_ref()
        .filter(|_| assumed.constraints.is_none())
    else {
        return false;
    };
    values.iter().enumerate().all(|(i, values)| {
        values.iter().all(|&s| {
            let x = about.map_or(s, |c| c[i] + (s - c[i]) * INSIDE);
            sides[i].contains(x)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Drawn;
    use crate::systems::Linear;
    use zonobench_sets::Matrix;

    fn problem() -> Problem {
        let one = || Matrix::identity(1);
        let system = crate::AnySystem::Linear(Linear::new(one(), None, one(), None).unwrap());
        let unit = || Uncertain::from_box(&[-1.0], &[1.0]).unwrap();
        Problem::new(system, unit(), unit(), unit()).unwrap()
    }

    fn truth(law: Law, truncate: bool, radius: f64) -> Truth {
        let of = Uncertain::from_box(&[-radius], &[radius]).unwrap();
        let mut of = Uncertain {
            covariance: Some(Matrix::identity(1)),
            ..of
        };
        of.mean = Some(vec![0.0]);
        let drawn = || {
            Noise::Drawn(Drawn {
                law,
                of: of.clone(),
                truncate,
            })
        };
        Truth {
            x0: InitialState::Point(vec![1.0]),
            w: drawn(),
            v: drawn(),
            delta: None,
        }
    }

    #[test]
    fn noise_in_the_assumed_box_is_admissible_and_a_free_gaussian_is_not() {
        assert!(truth(Law::Uniform, false, 1.0).is_admissible(&problem(), 5));
        assert!(truth(Law::Vertices, false, 0.5).is_admissible(&problem(), 5));
        assert!(truth(Law::Gaussian, true, 1.0).is_admissible(&problem(), 5));
        assert!(!truth(Law::Gaussian, false, 1.0).is_admissible(&problem(), 5));
        assert!(!truth(Law::Uniform, false, 1.5).is_admissible(&problem(), 5));
    }

    #[test]
    fn a_measurement_that_is_assumed_to_be_exact_is_rounded_all_the_same() {
        let mut exact = problem();
        exact.v = Uncertain::from_box(&[0.0], &[0.0]).unwrap();
        assert!(!truth(Law::Zero, false, 1.0).is_admissible(&exact, 5));
    }

    #[test]
    fn a_start_outside_the_prior_is_not_admissible() {
        let mut outside = truth(Law::Zero, false, 1.0);
        assert!(outside.is_admissible(&problem(), 5));
        outside.x0 = InitialState::Point(vec![1.5]);
        assert!(!outside.is_admissible(&problem(), 5));
    }
}
