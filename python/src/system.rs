//! Systems, and their equations evaluated on numbers and on boxes.
//!
//! They come from Python as JSON, in the form in which the crates write them; keywords and dictionaries are the package's.

use crate::errors::{error, of_estimation, of_sets};
use crate::numbers::{array_1, array_2, matrix, points, vector, vector_of};
use crate::sets::{AnySet, PySet, wrap};
use pyo3::prelude::*;
use zonobench_estimation::systems::Linear;
use zonobench_estimation::systems::equations::{Equations, Source};
use zonobench_estimation::{AnySystem, System};
use zonobench_sets::interval_matrix::partial_jacobian_over;
use zonobench_sets::number::{Function, Real, partial_jacobian};
use zonobench_sets::{IntervalVector, Matrix};

/// A discrete-time system: x+ = f(k, x, u, w), y = h(k, x, u, v).
///
/// Made by `System.equations`, `System.trace`, `System.linear` and by the named systems.
#[pyclass(name = "System", module = "zonobench", frozen)]
pub struct PySystem(pub AnySystem);

/// What serde says, without its place in a text that nobody wrote.
pub fn fault_of_json(fault: &serde_json::Error) -> String {
    let whole = fault.to_string();
    match whole.rfind(" at line ") {
        Some(at) => whole[..at].to_owned(),
        None => whole,
    }
}

/// The state and what is added to it by noise, stacked: numbers, or a box.
enum Point {
    Numbers(Vec<f64>),
    Sides(IntervalVector),
}

/// Which of the two equations.
#[derive(Clone, Copy)]
enum Side {
    Motion,
    Output,
}

/// (x, noise) -> f or h at one step and input.
struct Equation<'a> {
    system: &'a AnySystem,
    side: Side,
    k: usize,
    u: &'a [f64],
    n: usize,
    inputs: usize,
    outputs: usize,
}

impl Function for Equation<'_> {
    fn inputs(&self) -> usize {
        self.inputs
    }
    fn outputs(&self) -> usize {
        self.outputs
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        let (state, noise) = x.split_at(self.n);
        match self.side {
            Side::Motion => self.system.f(self.k, state, self.u, noise, y),
            Side::Output => self.system.h(self.k, state, self.u, noise, y),
        }
    }
}

fn part(what: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Point> {
    let point = match given.cast::<PySet>() {
        Ok(set) => match &set.get().0 {
            AnySet::Box(sides) => Point::Sides(sides.clone()),
            _ => return Err(error(format!("{what}: expected numbers or a Box"))),
        },
        Err(_) => Point::Numbers(vector(what, given)?),
    };
    let got = match &point {
        Point::Numbers(x) => x.len(),
        Point::Sides(x) => x.dim(),
    };
    if got == n {
        Ok(point)
    } else {
        Err(error(format!("{what}: expected {n} numbers, got {got}")))
    }
}

type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

impl PySystem {
    fn input(&self, u: Given) -> PyResult<Vec<f64>> {
        let n = self.0.variables().u.len();
        match u {
            Some(u) => vector_of("u", u, n),
            None if n == 0 => Ok(Vec::new()),
            None => Err(error(format!("u: expected {n} numbers, got none"))),
        }
    }

    /// The point (x, noise), and the equation's sizes; noise that is not given is 0.
    fn point(
        &self,
        side: Side,
        x: &Bound<'_, PyAny>,
        noise: Given,
    ) -> PyResult<(Point, [usize; 3])> {
        let variables = self.0.variables();
        let (name, n_noise, outputs) = match side {
            Side::Motion => ("w", variables.w.len(), variables.x.len()),
            Side::Output => ("v", variables.v.len(), variables.y.len()),
        };
        let n = variables.x.len();
        let x = part("x", x, n)?;
        let noise = match noise {
            Some(noise) => part(name, noise, n_noise)?,
            None => Point::Numbers(vec![0.0; n_noise]),
        };
        let both = match (x, noise) {
            (Point::Numbers(x), Point::Numbers(noise)) => Point::Numbers([x, noise].concat()),
            (x, noise) => {
                let sides = |p: Point| match p {
                    Point::Numbers(p) => points(&p),
                    Point::Sides(p) => p,
                };
                Point::Sides(IntervalVector::stack(&[&sides(x), &sides(noise)]))
            }
        };
        Ok((both, [n, n + n_noise, outputs]))
    }

    fn value<'py>(
        &self,
        py: Python<'py>,
        side: Side,
        (x, u, noise, k): (&Bound<'py, PyAny>, Given, Given, usize),
    ) -> PyResult<Py<PyAny>> {
        let u = self.input(u)?;
        let (point, [n, inputs, outputs]) = self.point(side, x, noise)?;
        let equation = Equation {
            system: &self.0,
            side,
            k,
            u: &u,
            n,
            inputs,
            outputs,
        };
        match point {
            Point::Numbers(x) => {
                let mut y = vec![0.0; outputs];
                equation.evaluate(&x, &mut y);
                Ok(array_1(py, &y).into_any().unbind())
            }
            Point::Sides(x) => {
                let mut y = vec![zonobench_sets::Interval::ZERO; outputs];
                equation.evaluate(x.as_slice(), &mut y);
                let y = IntervalVector::new(y);
                if !y.is_finite() {
                    return Err(self.undefined(&x, n));
                }
                wrap(py, AnySet::Box(y))
            }
        }
    }

    fn undefined(&self, x: &IntervalVector, n: usize) -> PyErr {
        let state: IntervalVector = x.iter().take(n).copied().collect();
        error(self.0.domain_fault(&state).unwrap_or_else(|| {
            "the equations may be undefined, or overflow, somewhere in the box".to_owned()
        }))
    }

    fn derivative<'py>(
        &self,
        py: Python<'py>,
        side: Side,
        (x, u, noise, k): (&Bound<'py, PyAny>, Given, Given, usize),
    ) -> PyResult<Py<PyAny>> {
        let u = self.input(u)?;
        let (point, [n, inputs, outputs]) = self.point(side, x, noise)?;
        let equation = Equation {
            system: &self.0,
            side,
            k,
            u: &u,
            n,
            inputs,
            outputs,
        };
        match point {
            Point::Numbers(x) => {
                let jacobian = partial_jacobian(&equation, &x, 0..n);
                let m = Matrix::from_fn(outputs, n, |i, j| jacobian.get(i, j));
                Ok(array_2(py, &m)?.into_any().unbind())
            }
            Point::Sides(x) => {
                let (_, m) =
                    partial_jacobian_over(&equation, &x, 0..n).map_err(|fault| {
                        match self.0.domain_fault(&x.iter().take(n).copied().collect()) {
                            Some(sentence) => error(sentence),
                            None => of_sets(fault),
                        }
                    })?;
                let bounds = (array_2(py, &m.lower())?, array_2(py, &m.upper())?);
                Ok(bounds.into_pyobject(py)?.into_any().unbind())
            }
        }
    }
}

fn named(of: &[zonobench_estimation::system::Variable]) -> Vec<(String, String)> {
    of.iter()
        .map(|v| (v.name.clone(), v.unit.to_string()))
        .collect()
}

#[pymethods]
impl PySystem {
    /// The system that `text` describes: JSON with `kind` and that kind's parameters, as `to_json` gives it.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        serde_json::from_str(text)
            .map(Self)
            .map_err(|fault| error(format!("system: {}", fault_of_json(&fault))))
    }

    /// The equations that `text` describes. A name that is not known raises an `Error` with the attribute `known`.
    #[staticmethod]
    fn _equations(py: Python<'_>, text: &str) -> PyResult<Self> {
        let source: Source = serde_json::from_str(text)
            .map_err(|fault| error(format!("equations: {}", fault_of_json(&fault))))?;
        match Equations::new(source) {
            Ok(equations) => Ok(Self(AnySystem::Equations(equations))),
            Err(fault) => {
                let raised = error(fault.to_string());
                raised.value(py).setattr("known", fault.known.to_vec())?;
                raised.value(py).setattr("got", fault.got.as_ref())?;
                Err(raised)
            }
        }
    }

    /// x+ = A x + B u + w, y = C x + D u + v, with w of n and v of m numbers.
    ///
    /// A: n x n; B: n x p; C: m x n; D: m x p. Without B and D there is no input.
    #[staticmethod]
    #[pyo3(signature = (A, B=None, C=None, D=None))]
    #[allow(non_snake_case)]
    fn linear(
        py: Python<'_>,
        A: &Bound<'_, PyAny>,
        B: Given,
        C: Given,
        D: Given,
    ) -> PyResult<Self> {
        let optional = |what, m: Given| m.map(|m| matrix(what, m)).transpose();
        let Some(c) = optional("C", C)? else {
            return Err(error(
                "linear: expected C, the matrix of the measurement, got none",
            ));
        };
        Linear::new(matrix("A", A)?, optional("B", B)?, c, optional("D", D)?)
            .map(|linear| Self(AnySystem::Linear(linear)))
            .map_err(|fault| of_estimation(py, fault))
    }

    /// The system as JSON: `kind` and its parameters.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|fault| error(fault.to_string()))
    }

    /// x+ = f(k, x, u, w): an array, or a `Box` that contains f all over the box x (or w).
    #[pyo3(signature = (x, u=None, w=None, k=0))]
    fn f<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        u: Given<'_, 'py>,
        w: Given<'_, 'py>,
        k: usize,
    ) -> PyResult<Py<PyAny>> {
        self.value(x.py(), Side::Motion, (x, u, w, k))
    }

    /// y = h(k, x, u, v): an array, or a `Box` that contains h all over the box x (or v).
    #[pyo3(signature = (x, u=None, v=None, k=0))]
    fn h<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        u: Given<'_, 'py>,
        v: Given<'_, 'py>,
        k: usize,
    ) -> PyResult<Py<PyAny>> {
        self.value(x.py(), Side::Output, (x, u, v, k))
    }

    /// The n x n matrix of the derivatives of f by x, by automatic differentiation.
    ///
    /// At a point, an array, rounded to nearest. Over a box, the pair (lower, upper) of matrices that contain all of them.
    #[pyo3(signature = (x, u=None, w=None, k=0))]
    fn jacobian<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        u: Given<'_, 'py>,
        w: Given<'_, 'py>,
        k: usize,
    ) -> PyResult<Py<PyAny>> {
        self.derivative(x.py(), Side::Motion, (x, u, w, k))
    }

    /// As `jacobian`, of h: m x n.
    #[pyo3(signature = (x, u=None, v=None, k=0))]
    fn output_jacobian<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        u: Given<'_, 'py>,
        v: Given<'_, 'py>,
        k: usize,
    ) -> PyResult<Py<PyAny>> {
        self.derivative(x.py(), Side::Output, (x, u, v, k))
    }

    /// "linear", "equations", "quadrotor", ...
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind()
    }
    /// The time from step to step in s, of a system that has one.
    #[getter]
    fn period(&self) -> Option<f64> {
        self.0.period()
    }
    /// True where the equations are a linear time-invariant system.
    #[getter]
    fn is_linear(&self) -> bool {
        self.0.linear_parts().is_some()
    }
    /// The state: (name, unit) of every component.
    #[getter]
    fn x(&self) -> Vec<(String, String)> {
        named(&self.0.variables().x)
    }
    /// The input, as `x`.
    #[getter]
    fn u(&self) -> Vec<(String, String)> {
        named(&self.0.variables().u)
    }
    /// The process noise, as `x`.
    #[getter]
    fn w(&self) -> Vec<(String, String)> {
        named(&self.0.variables().w)
    }
    /// The measurement, as `x`.
    #[getter]
    fn y(&self) -> Vec<(String, String)> {
        named(&self.0.variables().y)
    }
    /// The measurement noise, as `x`.
    #[getter]
    fn v(&self) -> Vec<(String, String)> {
        named(&self.0.variables().v)
    }
    /// What could be written tighter, in sentences: `x*x` where `x^2` is meant.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        match &self.0 {
            AnySystem::Equations(e) => e.warnings().iter().map(ToString::to_string).collect(),
            _ => Vec::new(),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other
            .cast::<Self>()
            .is_ok_and(|other| other.get().0 == self.0)
    }
    fn __repr__(&self) -> String {
        let v = self.0.variables();
        let names = |of: &[zonobench_estimation::system::Variable]| {
            of.iter()
                .map(|v| v.name.clone())
                .collect::<Vec<_>>()
                .join(", ")
        };
        format!(
            "System({}: x = ({}), u = ({}), y = ({}))",
            self.0.kind(),
            names(&v.x),
            names(&v.u),
            names(&v.y)
        )
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.getattr("from_json")?, (slf.get().to_json()?,)))
    }
}
