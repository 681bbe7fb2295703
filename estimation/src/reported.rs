//! What a program outside of this one says of x_k: numbers that were checked for their shape, and nothing more.

use crate::estimator::{Belief, Containment, Shape, Size, box_contains};
use crate::problem::check_covariance;
use zonobench_sets::{ConstrainedZonotope, Interval, IntervalVector, Matrix};

/// A and b of A ξ = b.
pub type Constraints = (Matrix, Vec<f64>);

/// A belief that was reported from outside: a point estimate, with a box, a constrained zonotope or both, and a
/// covariance, as far as they were said.
///
/// Its set is the intersection of the box and the constrained zonotope. Nothing of it is believed: whether it holds the
/// state is for the judge to say.
#[derive(Clone, Debug)]
pub struct Reported {
    center: Vec<f64>,
    bounds: Option<IntervalVector>,
    set: Option<ConstrainedZonotope>,
    covariance: Option<Matrix>,
}

impl Reported {
    /// From a center of length n, bounds, G (n × p) with A ξ = b, and a covariance.
    ///
    /// Without bounds they are the interval hull of the set; the point estimate of a set with constraints is the middle
    /// of its hull, as everywhere. Says what is wrong: a length, a number that is not finite, bounds that are the wrong way
    /// round or do not hold the center, a set without points, a matrix that is no covariance.
    pub fn new(
        center: Vec<f64>,
        bounds: Option<(Vec<f64>, Vec<f64>)>,
        set: Option<(Matrix, Option<Constraints>)>,
        covariance: Option<Matrix>,
    ) -> Result<Self, String> {
        let n = center.len();
        if let Some(x) = center.iter().find(|x| !x.is_finite()) {
            return Err(format!("center: expected finite numbers, got {x}"));
        }
        let bounds = match bounds {
            None => None,
            Some((lower, upper)) => {
                for (what, side) in [("lower", &lower), ("upper", &upper)] {
                    if side.len() != n {
                        let got = side.len();
                        return Err(format!("{what}: expected {n} numbers, got {got}"));
                    }
                }
                let bounds = IntervalVector::from_bounds(&lower, &upper);
                Some(bounds.map_err(|e| format!("lower, upper: {e}"))?)
            }
        };
        let constrained = matches!(&set, Some((_, Some(_))));
        let set = match set {
            None => None,
            Some((g, constraints)) => {
                if g.rows() != n {
                    let got = g.rows();
                    return Err(format!("generators: expected {n} rows, got {got}"));
                }
                let (a, b) = constraints.unwrap_or((Matrix::zeros(0, g.cols()), Vec::new()));
                let set = ConstrainedZonotope::new(center.clone(), g, a, b);
                Some(set.map_err(|e| format!("generators, constraints: {e}"))?)
            }
        };
        let hull = match (&set, &bounds) {
            (Some(set), None) => Some(
                set.interval_hull()
                    .map_err(|e| format!("generators, constraints: {e}"))?,
            ),
            _ => None,
        };
        let center = match &hull {
            Some(hull) if constrained => hull.mid().into_vec(),
            _ => center,
        };
        let bounds = bounds.or(hull);
        if let Some(bounds) = &bounds
            && !(constrained || bounds.contains(&center))
        {
            return Err("center: expected a point between lower and upper".to_owned());
        }
        if let Some(p) = &covariance {
            check_covariance("covariance", p, n).map_err(|e| e.to_string())?;
        }
        Ok(Self {
            center,
            bounds,
            set,
            covariance: covariance.map(|p| p.symmetrized()),
        })
    }
}

impl Belief for Reported {
    fn center(&self) -> Vec<f64> {
        self.center.clone()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        self.bounds.clone()
    }
    fn contains(&self, x: &[Interval]) -> Containment {
        let Some(bounds) = &self.bounds else {
            return Containment::Undecided;
        };
        let of_set = self.set.as_ref().map_or(Containment::Inside, |set| {
            set.contains(x).unwrap_or(Containment::Undecided)
        });
        match (box_contains(bounds, x), of_set) {
            (Containment::Outside, _) | (_, Containment::Outside) => Containment::Outside,
            (Containment::Inside, Containment::Inside) => Containment::Inside,
            _ => Containment::Undecided,
        }
    }
    fn covariance(&self) -> Option<&Matrix> {
        self.covariance.as_ref()
    }
    fn size(&self) -> Size {
        let radius = |hull: &IntervalVector| hull.rad().iter().copied().fold(0.0, f64::max);
        Size {
            n_generators: self.set.as_ref().map(ConstrainedZonotope::generators),
            n_constraints: self.set.as_ref().map(ConstrainedZonotope::constraints),
            radius: self.bounds.as_ref().map(radius),
            ..Size::default()
        }
    }
    /// Of a set with generators by its vertices, up to three dimensions, rounded to nearest; of a box the product of its
    /// edges.
    fn volume(&self) -> Option<f64> {
        match (&self.set, &self.bounds) {
            (Some(set), _) => set.volume().ok().flatten(),
            (None, Some(sides)) => Some(sides.iter().map(|s| s.hi() - s.lo()).product()),
            (None, None) => None,
        }
    }
    fn shape(&self) -> Shape {
        let drawn = Shape {
            center: self.center.clone(),
            covariance: self.covariance.clone(),
            ..Shape::default()
        };
        match (&self.set, &self.bounds) {
            (Some(set), _) => Shape {
                kind: "constrained-zonotope",
                center: set.c().to_vec(),
                generators: Some(set.g().clone()),
                constraints: Some((set.a().clone(), set.b().to_vec())),
                ..drawn
            },
            (None, Some(bounds)) => Shape {
                kind: "box",
                bounds: Some(bounds.clone()),
                ..drawn
            },
            (None, None) => Shape {
                kind: "gaussian",
                ..drawn
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn m(rows: &[&[f64]]) -> Matrix {
        Matrix::from_rows(rows).unwrap()
    }

    fn point(x: &[f64]) -> Vec<Interval> {
        x.iter().map(|&x| Interval::point(x)).collect()
    }

    #[test]
    fn a_box_and_a_zonotope_are_their_intersection() {
        let diamond = (m(&[&[0.5, 0.5], &[0.5, -0.5]]), None);
        let bounds = Some((vec![-0.5; 2], vec![0.5; 2]));
        let both = Reported::new(vec![0.0; 2], bounds, Some(diamond.clone()), None).unwrap();
        let alone = Reported::new(vec![0.0; 2], None, Some(diamond), None).unwrap();
        // Certified, and so rounded outward.
        let upper = alone.interval_hull().unwrap().upper();
        assert!(
            upper.iter().all(|u| (1.0..1.0 + 1e-14).contains(u)),
            "{upper:?}"
        );
        for (x, in_both, in_one) in [
            ([0.25, 0.25], Containment::Inside, Containment::Inside),
            ([0.75, 0.0], Containment::Outside, Containment::Inside),
            ([0.9, 0.9], Containment::Outside, Containment::Outside),
        ] {
            assert_eq!(both.contains(&point(&x)), in_both, "{x:?}");
            assert_eq!(alone.contains(&point(&x)), in_one, "{x:?}");
        }
    }

    #[test]
    fn what_is_said_wrongly_is_refused_with_its_key() {
        let refused = |bounds, set, covariance| {
            Reported::new(vec![0.0, 1.0], bounds, set, covariance).unwrap_err()
        };
        let short = refused(Some((vec![0.0], vec![1.0, 2.0])), None, None);
        assert_eq!(short, "lower: expected 2 numbers, got 1");
        let reversed = refused(Some((vec![0.0, 2.0], vec![1.0, 1.5])), None, None);
        assert!(reversed.starts_with("lower, upper: "), "{reversed}");
        let beside = refused(Some((vec![0.5, 0.0], vec![1.0, 2.0])), None, None);
        assert_eq!(beside, "center: expected a point between lower and upper");
        let rows = refused(None, Some((Matrix::identity(3), None)), None);
        assert_eq!(rows, "generators: expected 2 rows, got 3");
        let empty = (m(&[&[1.0], &[1.0]]), Some((m(&[&[1.0]]), vec![3.0])));
        let empty = refused(None, Some(empty), None);
        assert!(empty.starts_with("generators, constraints: "), "{empty}");
        let indefinite = refused(None, None, Some(m(&[&[1.0, 2.0], &[2.0, 1.0]])));
        assert!(indefinite.starts_with("covariance: "), "{indefinite}");
        let infinite = Reported::new(vec![f64::INFINITY], None, None, None).unwrap_err();
        assert_eq!(infinite, "center: expected finite numbers, got inf");
    }
}
