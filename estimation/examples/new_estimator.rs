//! A new estimator: an interval observer. It carries a box, moves it by interval arithmetic, and narrows one
//! component after the other by what the measurement leaves for it.

use zonobench_estimation::estimator::{Measurement, Phase, Shape, Size};
use zonobench_estimation::systems::Linear;
use zonobench_estimation::{
    AnySystem, Belief, EstimationError, Estimator, Inputs, Problem, System, Truth, Uncertain,
    simulate, track,
};
use zonobench_sets::{Containment, Interval, IntervalVector, Matrix};

/// A box that the state is in.
#[derive(Clone)]
struct Box(IntervalVector);

impl Belief for Box {
    fn center(&self) -> Vec<f64> {
        self.0.mid().into_vec()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        Some(self.0.clone())
    }
    fn contains(&self, x: &[Interval]) -> Containment {
        let x = IntervalVector::new(x.to_vec());
        if self.0.contains_box(&x) {
            Containment::Inside
        } else if self.0.intersect(&x).is_err() {
            Containment::Outside
        } else {
            Containment::Undecided
        }
    }
    fn covariance(&self) -> Option<&Matrix> {
        None
    }
    fn size(&self) -> Size {
        Size {
            radius: self.0.rad().into_iter().reduce(f64::max),
            ..Size::default()
        }
    }
    fn shape(&self) -> Shape {
        Shape {
            kind: "box",
            center: self.center(),
            bounds: Some(self.0.clone()),
            ..Shape::default()
        }
    }
}

/// predict: [x] ← f([x], u, [w]); update: [x_j] ← [x_j] ∩ (y_i − D_i u − [v_i] − Σ_{l ≠ j} C_il [x_l]) / C_ij for
/// every measured i and every j with C_ij ≠ 0. Outward rounding makes both enclosures.
struct IntervalObserver {
    problem: Problem,
    c: Matrix,
    d: Matrix,
}

impl IntervalObserver {
    fn new(problem: &Problem) -> Result<Self, EstimationError> {
        let Some(parts) = problem.system.linear_parts() else {
            return Err(EstimationError::Unsupported {
                kind: "interval-observer",
                what: problem.system.kind(),
                reason: "its update needs y = C x + D u + v".into(),
            });
        };
        Ok(Self {
            problem: problem.clone(),
            c: parts.c,
            d: parts.d,
        })
    }
}

impl Estimator for IntervalObserver {
    type Belief = Box;

    fn prior(&self) -> Box {
        Box(self.problem.prior.box_hull())
    }

    fn predict(&self, k: usize, belief: &Box, u_prev: &[f64]) -> Result<Box, EstimationError> {
        let w = self.problem.w.box_hull();
        let mut next = belief.0.as_slice().to_vec();
        self.problem
            .system
            .f(k - 1, belief.0.as_slice(), u_prev, w.as_slice(), &mut next);
        let next = IntervalVector::new(next)
            .finite("prediction")
            .map_err(EstimationError::at(k, "predict"))?;
        Ok(Box(next))
    }

    fn update(
        &self,
        k: usize,
        belief: &Box,
        u: &[f64],
        y: Measurement,
    ) -> Result<Box, EstimationError> {
        let v = self.problem.v.box_hull();
        let mut x = belief.0.as_slice().to_vec();
        for (i, y) in y.iter().enumerate() {
            let Some(y) = y else { continue };
            let known = u.iter().enumerate().fold(-v[i], |sum, (j, u)| {
                sum - Interval::point(*u) * self.d[(i, j)]
            }) + *y;
            for j in 0..x.len() {
                if self.c[(i, j)] == 0.0 {
                    continue;
                }
                let others = (0..x.len()).filter(|l| *l != j);
                let rest = others.fold(known, |rest, l| rest - x[l] * self.c[(i, l)]);
                let left = rest / self.c[(i, j)];
                x[j] = x[j]
                    .intersect(&left)
                    .ok_or(EstimationError::Inconsistent { k })?;
            }
        }
        Ok(Box(IntervalVector::new(x)))
    }

    fn guaranteed(&self) -> bool {
        true
    }
    fn reads(&self) -> &'static str {
        "y_0 to y_k"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
}

/// Follows a simulated system for 50 steps in each of 20 runs; no set may lose the truth.
pub fn main() {
    let rows = |rows: [[f64; 2]; 2]| Matrix::from_fn(2, 2, |i, j| rows[i][j]);
    let system = Linear::new(
        rows([[0.9, 0.2], [-0.1, 0.8]]),
        None,
        Matrix::from_fn(1, 2, |_, _| 1.0),
        None,
    )
    .expect("the dimensions fit");
    let uniform = |radius: f64, n: usize| {
        Uncertain::from_box(&vec![-radius; n], &vec![radius; n]).expect("a box")
    };
    let problem = Problem::new(
        AnySystem::Linear(system),
        uniform(5.0, 2),
        uniform(0.1, 2),
        uniform(0.2, 1),
    )
    .expect("the parts fit");
    let observer = IntervalObserver::new(&problem).expect("the system is linear");
    let truth = Truth::assumed(&problem).expect("all is described by sets");
    let mut last = f64::INFINITY;
    for run in 0..20 {
        let real = simulate(
            &problem.system,
            &truth,
            &Inputs::Constant(vec![]),
            7,
            run,
            50,
        )
        .expect("it fits");
        let measured: Vec<Vec<Option<f64>>> = real
            .y
            .iter()
            .map(|y| y.iter().copied().map(Some).collect())
            .collect();
        for step in track(&observer, 50, &real.u, &measured) {
            let belief = step.updated.expect("the truth keeps to what is assumed");
            let x: Vec<Interval> = real.x[step.k].iter().map(|x| Interval::point(*x)).collect();
            assert_eq!(
                belief.contains(&x),
                Containment::Inside,
                "run {run}, k = {}",
                step.k
            );
            last = belief.size().radius.expect("a box has a radius");
        }
    }
    // The prior has a radius of 5.
    assert!(last < 5.0 / 3.0, "it did not narrow: {last}");
    println!("20 runs of 50 steps, no set lost the truth; the last radius is {last:.3}");
}
