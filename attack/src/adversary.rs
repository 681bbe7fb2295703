//! Noise within its bounds, and as bad as can be.

use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::{Belief, Estimator, Problem, System};
use zonobench_sets::IntervalVector;

/// How the first state and the noise are chosen; always within what the estimator is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attack {
    /// Uniform in the boxes.
    Uniform,
    /// A vertex of its box, drawn anew at every step.
    Vertices,
    /// All components jump together from a vertex to the opposite one, every few steps.
    BangBang,
    /// One vertex for good.
    Constant,
    /// An adversary that sees the estimator's sets: w drives the state away from the center of the set,
    /// in units of its half-widths, and v hides it.
    Chase,
}

impl Attack {
    /// Every attack.
    pub const ALL: [Attack; 5] = [
        Attack::Uniform,
        Attack::Vertices,
        Attack::BangBang,
        Attack::Constant,
        Attack::Chase,
    ];

    /// Its name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Attack::Uniform => "uniform",
            Attack::Vertices => "vertices",
            Attack::BangBang => "bang-bang",
            Attack::Constant => "constant",
            Attack::Chase => "chase",
        }
    }
}

/// What an attack chose: x_0, w_0 … w_{N−1}, v_0 … v_N.
pub(crate) struct Choice {
    pub x0: Vec<f64>,
    pub w: Vec<Vec<f64>>,
    pub v: Vec<Vec<f64>>,
}

/// A box whose vertices are named by signs.
struct Bounds {
    center: Vec<f64>,
    radius: Vec<f64>,
}

impl Bounds {
    /// The box, drawn together about its center to the share `inside`.
    fn new(hull: &IntervalVector, inside: f64) -> Self {
        Self {
            center: hull.iter().map(|side| side.mid()).collect(),
            radius: hull
                .iter()
                .map(|side| 0.5 * inside * side.width())
                .collect(),
        }
    }

    /// center + radius · s.
    fn at(&self, s: impl Fn(usize) -> f64) -> Vec<f64> {
        let both = self.center.iter().zip(&self.radius).enumerate();
        both.map(|(i, (c, r))| c + r * s(i)).collect()
    }
}

/// The choice of `attack` against `estimator` in run `run` of `steps` steps, within the share `inside` of the bounds.
pub(crate) fn choose<E: Estimator, Y: System>(
    attack: Attack,
    estimator: &E,
    problem: &Problem<Y>,
    inputs: &[Vec<f64>],
    inside: f64,
    (seed, run): (u64, u64),
    steps: usize,
) -> Choice {
    let [x0, w, v] =
        [&problem.prior, &problem.w, &problem.v].map(|u| Bounds::new(&u.box_hull(), inside));
    let mut draws = [Purpose::X0, Purpose::W, Purpose::V].map(|p| Draws::new(seed, p, run));
    let [draw_x0, draw_w, draw_v] = &mut draws;
    let vertex = |bounds: &Bounds, draws: &mut Draws, k: usize| {
        let signs: Vec<f64> = (0..bounds.center.len())
            .map(|i| draws.sign(k, i, 0))
            .collect();
        bounds.at(|i| signs[i])
    };
    let first = match attack {
        Attack::Uniform => x0.at(|i| draw_x0.clone().uniform(0, i, 0)),
        _ => vertex(&x0, draw_x0, 0),
    };
    let noise = |bounds: &Bounds, draws: &mut Draws, count: usize| -> Vec<Vec<f64>> {
        // Address `steps + 1` holds what is drawn once.
        let once = steps + 1;
        let signs: Vec<f64> = (0..bounds.center.len())
            .map(|i| draws.sign(once, i, 0))
            .collect();
        let period = 1 + (25.0 * (1.0 + draws.uniform(once, 0, 1))) as usize;
        let at = |k: usize| match attack {
            Attack::Uniform => {
                let s: Vec<f64> = (0..signs.len()).map(|i| draws.uniform(k, i, 0)).collect();
                bounds.at(|i| s[i])
            }
            Attack::Vertices => vertex(bounds, draws, k),
            Attack::BangBang if (k / period) % 2 == 1 => bounds.at(|i| -signs[i]),
            Attack::BangBang | Attack::Constant => bounds.at(|i| signs[i]),
            Attack::Chase => bounds.center.clone(),
        };
        (0..count).map(at).collect()
    };
    let mut choice = Choice {
        x0: first,
        w: noise(&w, draw_w, steps),
        v: noise(&v, draw_v, steps + 1),
    };
    if attack == Attack::Chase {
        chase(estimator, &problem.system, inputs, [&w, &v], &mut choice);
    }
    choice
}

/// Runs the estimator and lets the noise follow its sets; where the estimator ends, so does the pursuit.
fn chase<E: Estimator, Y: System>(
    estimator: &E,
    system: &Y,
    inputs: &[Vec<f64>],
    [w, v]: [&Bounds; 2],
    choice: &mut Choice,
) {
    let n_y = system.variables().y.len();
    let mut x = choice.x0.clone();
    let mut belief = estimator.prior();
    let steps = choice.w.len();
    for (k, u) in inputs.iter().enumerate().take(steps + 1) {
        let center = belief.center();
        let mut expected = vec![0.0; n_y];
        let mut seen = vec![0.0; n_y];
        system.h(k, &center, u, &v.center, &mut expected);
        system.h(k, &x, u, &v.center, &mut seen);
        // What is measured looks like the center.
        let hide = |i: usize| {
            if seen.get(i) >= expected.get(i) {
                -1.0
            } else {
                1.0
            }
        };
        choice.v[k] = v.at(hide);
        system.h(k, &x, u, &choice.v[k], &mut seen);
        let y: Vec<Option<f64>> = seen.iter().copied().map(Some).collect();
        let updated = if k == 0 && !estimator.uses_first_measurement() {
            Ok(belief)
        } else {
            estimator.update(k, &belief, u, &y)
        };
        let Ok(updated) = updated else { return };
        if k == steps {
            return;
        }
        let (center, hull) = (updated.center(), updated.interval_hull());
        let unit = |i: usize| {
            hull.as_ref()
                .map_or(1.0, |h| 0.5 * h[i].width())
                .max(1e-300)
        };
        let mut from = vec![0.0; x.len()];
        system.f(k, &center, u, &w.center, &mut from);
        let distance = |noise: &[f64]| {
            let mut to = vec![0.0; x.len()];
            system.f(k, &x, u, noise, &mut to);
            (0..to.len()).fold(0.0, |far: f64, i| {
                far.max((to[i] - from[i]).abs() / unit(i))
            })
        };
        // Component by component to the end that drives farther.
        let mut signs = vec![1.0; w.center.len()];
        for i in 0..signs.len() {
            let forward = distance(&w.at(|j| signs[j]));
            signs[i] = -1.0;
            if distance(&w.at(|j| signs[j])) < forward {
                signs[i] = 1.0;
            }
        }
        choice.w[k] = w.at(|i| signs[i]);
        let mut next = vec![0.0; x.len()];
        system.f(k, &x, u, &choice.w[k], &mut next);
        x = next;
        let reduced = estimator.reduce_order(k, updated);
        match reduced.and_then(|b| estimator.predict(k + 1, &b, u)) {
            Ok(b) => belief = b,
            Err(_) => return,
        }
    }
}
