//! A system of one's own, from its equations to sets that are proved to hold its state: a pendulum with drag, of which the distance
//! from a point 2 m aside of its pivot is measured.

use zonobench_estimation::estimators::{Czmv, CzmvSettings};
use zonobench_estimation::sets::number::Real;
use zonobench_estimation::system::{System, Variable, Variables};
use zonobench_estimation::{Belief, Inputs, Online, Problem, Truth, Uncertain, simulate};

/// θ⁺ = θ + T ω, ω⁺ = ω − T (g sin θ + d ω) + w, y = √((2 − sin θ)² + cos² θ) + v: a rod of 1 m.
#[derive(Clone, Debug)]
struct Pendulum {
    /// T in s
    period: f64,
    /// d in 1/s
    drag: f64,
}

impl System for Pendulum {
    fn variables(&self) -> Variables {
        Variables {
            x: vec![
                Variable::new("theta", "rad"),
                Variable::new("omega", "rad/s"),
            ],
            u: vec![],
            w: vec![Variable::new("w", "rad/s")],
            y: vec![Variable::new("range", "m")],
            v: vec![Variable::new("v", "m")],
        }
    }
    fn f<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], w: &[S], next: &mut [S]) {
        next[0] = x[0] + x[1] * self.period;
        next[1] = x[1] - (x[0].sin() * 9.81 + x[1] * self.drag) * self.period + w[0];
    }
    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        y[0] = (-x[0].sin() + 2.0).hypot(x[0].cos()) + v[0];
    }
}

/// Simulates the pendulum and holds the sets of `czmv` against the state that they have not seen.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let pendulum = Pendulum {
        period: 0.02,
        drag: 0.1,
    };
    let prior = Uncertain::from_box(&[0.2, -0.1], &[0.4, 0.1])?;
    let (w, v) = (
        Uncertain::from_box(&[-0.002], &[0.002])?,
        Uncertain::from_box(&[-0.01], &[0.01])?,
    );
    let problem = Problem::new(pendulum, prior, w, v)?;
    let mut filter = Online::new(Czmv::new(&CzmvSettings::new(20, 5), &problem)?);
    let (truth, inputs) = (Truth::assumed(&problem)?, Inputs::Constant(vec![]));
    let data = simulate(&problem.system, &truth, &inputs, 1, 0, 100)?;
    for (k, (x, y)) in data.x.iter().zip(&data.y).enumerate() {
        let hull = filter
            .step(&[], &[Some(y[0])])?
            .interval_hull()
            .ok_or("no hull")?;
        println!(
            "{k:3}: theta in [{:.4}, {:.4}], is {:.4}",
            hull[0].lo(),
            hull[0].hi(),
            x[0]
        );
        assert!(hull.contains(x), "k = {k}: {hull:?} does not hold {x:?}");
    }
    Ok(())
}
