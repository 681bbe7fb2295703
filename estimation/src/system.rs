//! Discrete-time systems: x_{k+1} = f(k, x_k, u_k, w_k), y_k = h(k, x_k, u_k, v_k).
//!
//! A system is its equations, written once for every number they can be evaluated on, and what else is known of them: all that an
//! estimator is told of a system is the trait [`System`]. Anyone can write one. Those that files name are the family
//! [`AnySystem`]: one file each under `systems/`, one line each below.

use crate::EstimationError;
use crate::controller::FeedbackLinearising;
use crate::propagation::Output;
use crate::systems::{
    Equations, Linear, Lpv, Quadrotor, Raimondo, Unicycle, VanDerPol, VehicleSe2,
};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use zonobench_sets::number::Real;
use zonobench_sets::{Interval, IntervalVector, Matrix};

/// One component of a vector: its name and its unit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Variable {
    /// The name, unique within its vector.
    pub name: String,
    /// The UCUM code of the unit: "1", "m", "rad", …
    pub unit: Cow<'static, str>,
}

impl Variable {
    /// `name` in `unit`.
    pub fn new(name: impl Into<String>, unit: impl Into<Cow<'static, str>>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
        }
    }

    /// `n` dimensionless components x1, …, xn for the prefix "x".
    pub fn numbered(prefix: &str, n: usize) -> Vec<Self> {
        (1..=n)
            .map(|i| Self::new(format!("{prefix}{i}"), "1"))
            .collect()
    }
}

/// The components of every vector of a system; the lengths are its dimensions.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize)]
pub struct Variables {
    /// State.
    pub x: Vec<Variable>,
    /// Input.
    pub u: Vec<Variable>,
    /// Process noise; of an LPV system, also δ after it.
    pub w: Vec<Variable>,
    /// Measurement.
    pub y: Vec<Variable>,
    /// Measurement noise.
    pub v: Vec<Variable>,
}

/// A discrete-time system, written once for every number.
///
/// Laws: `f` writes every component of `next` and `h` every component of `y`; neither branches on a
/// state; evaluated on intervals, both contain the value at every point of the arguments; a clone is the same system.
/// Slices have the lengths of [`Variables`]; their lengths are checked by the callers.
///
/// `variables`, `f` and `h` are all that has to be written. The rest has a default that claims nothing: an estimator that needs
/// more refuses the system, and the others take a little longer.
///
/// ```
/// use zonobench_estimation::system::{System, Variable, Variables};
/// use zonobench_sets::number::Real;
///
/// /// θ⁺ = θ + T ω, ω⁺ = ω − T (g/l sin θ) + w; the bob's height above its lowest point is measured.
/// #[derive(Clone, Debug)]
/// struct Pendulum { period: f64, length: f64 }
///
/// impl System for Pendulum {
///     fn variables(&self) -> Variables {
///         Variables {
///             x: vec![Variable::new("theta", "rad"), Variable::new("omega", "rad/s")],
///             u: vec![],
///             w: vec![Variable::new("w", "rad/s")],
///             y: vec![Variable::new("height", "m")],
///             v: vec![Variable::new("v", "m")],
///         }
///     }
///     fn f<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], w: &[S], next: &mut [S]) {
///         next[0] = x[0] + x[1] * self.period;
///         next[1] = x[1] - x[0].sin() * 9.81 / self.length * self.period + w[0];
///     }
///     fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
///         y[0] = (-x[0].cos() + 1.0) * self.length + v[0];
///     }
/// }
/// # let pendulum = Pendulum { period: 0.02, length: 1.0 };
/// # let mut next = [0.0; 2];
/// # pendulum.f(0, &[0.0, 1.0], &[], &[0.0], &mut next);
/// # assert_eq!((next, pendulum.kind()), ([0.02, 1.0], "Pendulum"));
/// ```
pub trait System: Clone + Send + Sync {
    /// The names and units of all components.
    fn variables(&self) -> Variables;
    /// x_{k+1} = f(k, x_k, u_k, w_k), into `next`.
    fn f<S: Real>(&self, k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]);
    /// y_k = h(k, x_k, u_k, v_k), into `y`.
    fn h<S: Real>(&self, k: usize, x: &[S], u: &[f64], v: &[S], y: &mut [S]);

    /// What it is called in errors, and the value of `kind` in a file: the type's name.
    fn kind(&self) -> &'static str {
        let path = std::any::type_name::<Self>();
        let generic = path.find('<').unwrap_or(path.len());
        let start = path[..generic].rfind("::").map_or(0, |at| at + 2);
        &path[start..]
    }
    /// The time from step to step in s, of a system that has one.
    fn period(&self) -> Option<f64> {
        None
    }
    /// d, the number of parameters δ at the end of w.
    fn n_delta(&self) -> usize {
        0
    }
    /// Whether h(k, x_k, u_k, v_k) may hold u_k. Where it does not, nothing reads the input of the last step.
    fn measures_input(&self) -> bool {
        true
    }
    /// A, B, C, D of a linear time-invariant system: f is A x + B u + w, h is C x + D u + v.
    fn linear_parts(&self) -> Option<LinearParts> {
        None
    }
    /// C and D_v of an h that is C x + D_v v + h(k, 0, u, 0) at every step and input, exactly. Where nothing is said, it is looked for
    /// at every measurement over the set at hand.
    fn linear_output(&self) -> Option<(Matrix, Matrix)> {
        let c = self.quasi_lpv()?.output_matrix();
        let identity = Matrix::identity(c.rows());
        Some((c, identity))
    }
    /// Why the equations are not defined all over a box of states, where that is known.
    fn domain_fault(&self, over: &IntervalVector) -> Option<String> {
        let _ = over;
        None
    }
    /// The quasi-LPV form of a system that has one.
    fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
        None
    }
    /// The controller that linearises it by feedback, at its start; of the quadrotor.
    fn feedback_linearising(&self) -> Option<FeedbackLinearising> {
        None
    }
    /// Itself where it is the vehicle on SE(2), whose filters know its group.
    fn as_vehicle(&self) -> Option<&VehicleSe2> {
        None
    }
    /// How far a trajectory is from the exact one: that of [`simulate`](crate::simulate()). A family of many systems has it
    /// compiled once.
    #[doc(hidden)]
    fn trajectory_error(&self, x: &[Vec<f64>], u: &[Vec<f64>], w: &[Vec<f64>]) -> Vec<Vec<f64>> {
        crate::trajectory_error::trajectory_error(self, x, u, w)
    }
}

/// C and D_v of a system that is known to have no kink and the same ones at every step and input.
pub(crate) fn constant_output<Y: System>(system: &Y) -> Option<(Matrix, Matrix)> {
    let variables = system.variables();
    let u = vec![0.0; variables.u.len()];
    let output = Output::new(system, 0, &u);
    let anywhere = vec![Interval::UNIT; variables.x.len() + variables.v.len()];
    output.coefficients(&IntervalVector::new(anywhere))
}

/// x⁺ = (A₀ + Σ_i δ_i A_i) x + B u + w with |δ_i| ≤ 1, valid over a box of states.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding {
    /// A₀, n × n.
    pub a0: Matrix,
    /// A₁ … A_d, each n × n.
    pub a: Vec<Matrix>,
}

/// A system that can be written in quasi-LPV form: x⁺ = A(x) x + B u + w, y = C x + D u + v.
pub trait QuasiLpv: Send + Sync {
    /// Matrices with A(x) ∈ { A₀ + Σ δ_i A_i : |δ_i| ≤ 1 } for every x of the box `over`.
    ///
    /// A₀ and A_i are rounded to nearest. Fails where the box is so large that they are not finite.
    fn embed(&self, k: usize, over: &IntervalVector) -> Result<Embedding, EstimationError>;
    /// B, n × p.
    fn input_matrix(&self) -> Matrix;
    /// C, m × n.
    fn output_matrix(&self) -> Matrix;
    /// D, m × p.
    fn feedthrough(&self) -> Matrix;
}

/// The matrices of x⁺ = A x + B u + w, y = C x + D u + v.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearParts {
    /// A, n × n.
    pub a: Matrix,
    /// B, n × p.
    pub b: Matrix,
    /// C, m × n.
    pub c: Matrix,
    /// D, m × p.
    pub d: Matrix,
}

macro_rules! systems {
    ($($variant:ident),+ $(,)?) => {
        /// Every system there is. Its serialized form is canonical: the tag `kind` and the parameters.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind", rename_all = "kebab-case")]
        pub enum AnySystem {
            $(#[doc = concat!("[`", stringify!($variant), "`]")] $variant($variant)),+
        }

        impl System for AnySystem {
            fn variables(&self) -> Variables {
                match self { $(Self::$variant(s) => s.variables()),+ }
            }
            #[inline]
            fn f<S: Real>(&self, k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
                match self { $(Self::$variant(s) => s.f(k, x, u, w, next)),+ }
            }
            #[inline]
            fn h<S: Real>(&self, k: usize, x: &[S], u: &[f64], v: &[S], y: &mut [S]) {
                match self { $(Self::$variant(s) => s.h(k, x, u, v, y)),+ }
            }
            fn kind(&self) -> &'static str {
                match self { $(Self::$variant(s) => s.kind()),+ }
            }
            fn period(&self) -> Option<f64> {
                match self { $(Self::$variant(s) => s.period()),+ }
            }
            fn n_delta(&self) -> usize {
                match self { $(Self::$variant(s) => System::n_delta(s)),+ }
            }
            fn measures_input(&self) -> bool {
                match self { $(Self::$variant(s) => s.measures_input()),+ }
            }
            fn linear_parts(&self) -> Option<LinearParts> {
                match self { $(Self::$variant(s) => s.linear_parts()),+ }
            }
            fn linear_output(&self) -> Option<(Matrix, Matrix)> {
                match self { $(Self::$variant(s) => s.linear_output()),+ }
            }
            fn domain_fault(&self, over: &IntervalVector) -> Option<String> {
                match self { $(Self::$variant(s) => s.domain_fault(over)),+ }
            }
            fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
                match self { $(Self::$variant(s) => s.quasi_lpv()),+ }
            }
            fn feedback_linearising(&self) -> Option<FeedbackLinearising> {
                match self { $(Self::$variant(s) => s.feedback_linearising()),+ }
            }
            fn as_vehicle(&self) -> Option<&VehicleSe2> {
                match self { $(Self::$variant(s) => s.as_vehicle()),+ }
            }
            fn trajectory_error(&self, x: &[Vec<f64>], u: &[Vec<f64>], w: &[Vec<f64>]) -> Vec<Vec<f64>> {
                crate::trajectory_error::trajectory_error(self, x, u, w)
            }
        }
    };
}

systems!(
    Linear, Lpv, VanDerPol, Raimondo, VehicleSe2, Quadrotor, Unicycle, Equations
);

impl AnySystem {
    /// The key of [`System::period`] in a file.
    pub fn period_key(&self) -> Option<&'static str> {
        match self {
            Self::VanDerPol(_) => Some("ts"),
            Self::VehicleSe2(_) | Self::Quadrotor(_) => Some("dt"),
            Self::Unicycle(_) => Some("t0"),
            Self::Equations(s) => s.period().map(|_| "period"),
            Self::Linear(_) | Self::Lpv(_) | Self::Raimondo(_) => None,
        }
    }
}

/// Σ_j m_ij x_j in ascending j without the zero coefficients, which would only widen an interval.
#[inline]
pub(crate) fn row_times<S: Real>(row: &[f64], x: &[S]) -> S {
    let mut terms = row
        .iter()
        .zip(x)
        .filter(|(m, _)| **m != 0.0)
        .map(|(&m, &x)| x * m);
    let first = terms.next().unwrap_or_else(|| S::constant(0.0));
    terms.fold(first, |sum, term| sum + term)
}

/// row · u added to `sum`, rounded in the arithmetic of `S`.
#[inline]
pub(crate) fn plus_row_times<S: Real>(sum: S, row: &[f64], u: &[f64]) -> S {
    row.iter()
        .zip(u)
        .filter(|(m, _)| **m != 0.0)
        .fold(sum, |sum, (&m, &u)| sum + S::constant(u) * m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::Form;
    use crate::systems::equations::{Motion, Source};

    /// x⁺ = sin(x) + u, y = `output`.
    fn equations(output: &str) -> AnySystem {
        let named = |name: &str| vec![(name.to_owned(), "1".to_owned())];
        let source = Source {
            x: named("x1"),
            u: named("u1"),
            w: Vec::new(),
            y: named("y1"),
            v: Vec::new(),
            parameters: Vec::new(),
            definitions: Vec::new(),
            motion: Motion::Next(vec![("x1".to_owned(), "sin(x1) + u1".to_owned())]),
            output: vec![("y1".to_owned(), output.to_owned())],
            period: None,
        };
        AnySystem::Equations(Equations::new(source).unwrap())
    }

    #[test]
    fn a_system_that_does_not_measure_its_input_has_the_same_output_for_any() {
        let m = |rows: &[&[f64]]| {
            let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.to_vec()).collect();
            Matrix::from_rows(&rows).unwrap()
        };
        let (one, b) = (m(&[&[0.9]]), Some(m(&[&[1.0, 2.0]])));
        let linear = |d| Linear::new(one.clone(), b.clone(), one.clone(), d).map(AnySystem::Linear);
        let systems = [
            linear(None).unwrap(),
            linear(Some(m(&[&[0.0, -0.0]]))).unwrap(),
            linear(Some(m(&[&[0.0, 1e-300]]))).unwrap(),
            AnySystem::Lpv(
                Lpv::new(one.clone(), vec![one.clone()], b.clone(), one.clone()).unwrap(),
            ),
            AnySystem::VanDerPol(VanDerPol::new(0.1).unwrap()),
            AnySystem::Raimondo(Raimondo::default()),
            AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::default()).unwrap()),
            AnySystem::Quadrotor(Quadrotor::new(1.0, 0.2, [0.1, 0.1, 0.2], 9.81, 0.01).unwrap()),
            AnySystem::Unicycle(Unicycle::new(1.0, 0.3, 0.1, vec![[5.0, 15.0]]).unwrap()),
            equations("x1 * x1"),
            equations("x1 * x1 + 3 * u1"),
            equations("u1"),
        ];
        for system in systems {
            let sizes = system.variables();
            let x: Vec<f64> = (1..=sizes.x.len()).map(|i| 0.1 * i as f64).collect();
            let v = vec![0.0; sizes.v.len()];
            let output = |u: f64| {
                let mut y = vec![0.0; sizes.y.len()];
                system.h(3, &x, &vec![u; sizes.u.len()], &v, &mut y);
                y
            };
            assert_eq!(
                output(1e300) == output(-1e300),
                !system.measures_input(),
                "{system:?}"
            );
        }
    }
}
