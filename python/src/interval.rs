//! Intervals, with their arithmetic.

use crate::errors::{error, of_sets};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use zonobench_sets::{Interval, Real, SetError};

/// Interval(lo, hi=None): the real numbers from lo to hi, or the one number lo.
///
/// Sums, differences, products, quotients and functions contain every exact result for numbers taken from their arguments;
/// bounds are rounded outward. `x & y` is the intersection, `x | y` the hull of both, `v in x` membership. A function
/// outside its domain raises `Error`.
///
/// lo, hi: finite numbers with lo <= hi.
#[pyclass(name = "Interval", module = "zonobench", frozen)]
#[derive(Clone, Copy)]
pub struct PyInterval(pub Interval);

/// An interval, or a number as a point.
pub fn interval(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Interval> {
    if let Ok(interval) = given.cast::<PyInterval>() {
        return Ok(interval.get().0);
    }
    Ok(Interval::point(finite(what, given)?))
}

/// A finite number that a float64 holds exactly.
pub fn finite(what: &str, given: &Bound<'_, PyAny>) -> PyResult<f64> {
    let convert = given.py().import("zonobench._convert")?;
    let x: f64 = match given.cast_exact::<pyo3::types::PyFloat>() {
        Ok(x) => x.value(),
        Err(_) => {
            let array = convert.getattr("exactly")?.call1((what, given))?;
            if array.getattr("ndim")?.extract::<usize>()? != 0 {
                return Err(error(format!("{what}: expected a number, got an array")));
            }
            array.call_method0("item")?.extract()?
        }
    };
    if x.is_finite() {
        Ok(x)
    } else {
        Err(error(format!("{what}: expected a finite number, got {x}")))
    }
}

fn defined(op: &'static str, x: Interval) -> PyResult<PyInterval> {
    x.finite(op).map(PyInterval).map_err(of_sets)
}

/// `other` as an interval, where it is one or a number; `None` gives the other side its turn.
fn operand(other: &Bound<'_, PyAny>) -> Option<Interval> {
    interval("interval", other).ok()
}

fn with(
    other: &Bound<'_, PyAny>,
    op: &'static str,
    f: impl FnOnce(Interval) -> Interval,
) -> PyResult<Py<PyAny>> {
    let py = other.py();
    match operand(other) {
        Some(x) => Ok(Py::new(py, defined(op, f(x))?)?.into_any()),
        None => Ok(py.NotImplemented()),
    }
}

/// x^y; of an integer y, the power that knows its factors are equal.
fn power(x: Interval, y: Interval) -> Interval {
    let whole = y.lo() as i32;
    match y.is_point() {
        true if f64::from(whole) == y.lo() => x.powi(whole),
        true => x.powf(y.lo()),
        false => x.pow(y),
    }
}

#[pymethods]
impl PyInterval {
    #[new]
    #[pyo3(signature = (lo, hi=None))]
    fn new(lo: &Bound<'_, PyAny>, hi: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let lower = finite("lo", lo)?;
        let upper = hi.map_or(Ok(lower), |hi| finite("hi", hi))?;
        Interval::new(lower, upper)
            .map(Self)
            .map_err(|fault| match fault {
                SetError::Reversed { .. } => error(format!(
                    "interval: expected lo <= hi, got [{lower}, {upper}]"
                )),
                other => of_sets(other),
            })
    }

    /// The lower bound.
    #[getter]
    fn lo(&self) -> f64 {
        self.0.lo()
    }
    /// The upper bound.
    #[getter]
    fn hi(&self) -> f64 {
        self.0.hi()
    }
    /// A number of the interval near its middle.
    #[getter]
    fn mid(&self) -> f64 {
        self.0.mid()
    }
    /// An upper bound on the distance from `mid` to either end.
    #[getter]
    fn rad(&self) -> f64 {
        self.0.rad()
    }
    /// An upper bound on hi - lo.
    #[getter]
    fn width(&self) -> f64 {
        self.0.width()
    }

    fn __repr__(&self) -> String {
        format!("Interval({:?}, {:?})", self.0.lo(), self.0.hi())
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (f64, f64))> {
        let x = slf.get().0;
        Ok((slf.get_type().into_any(), (x.lo(), x.hi())))
    }
    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other
            .cast::<Self>()
            .is_ok_and(|other| other.get().0 == self.0)
    }
    fn __hash__(&self) -> u64 {
        self.0.lo().to_bits() ^ self.0.hi().to_bits().rotate_left(32)
    }
    fn __contains__(&self, x: &Bound<'_, PyAny>) -> PyResult<bool> {
        Ok(self.0.contains_interval(interval("x", x)?))
    }

    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "sum", |y| self.0 + y)
    }
    fn __radd__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "sum", |y| y + self.0)
    }
    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "difference", |y| self.0 - y)
    }
    fn __rsub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "difference", |y| y - self.0)
    }
    fn __mul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "product", |y| self.0 * y)
    }
    fn __rmul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "product", |y| y * self.0)
    }
    fn __truediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "quotient", |y| self.0 / y)
    }
    fn __rtruediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        with(other, "quotient", |y| y / self.0)
    }
    fn __pow__(
        &self,
        n: &Bound<'_, PyAny>,
        modulo: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let py = n.py();
        if modulo.is_some() {
            return Ok(py.NotImplemented());
        }
        with(n, "power", |y| power(self.0, y))
    }
    fn __rpow__(
        &self,
        base: &Bound<'_, PyAny>,
        modulo: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        if modulo.is_some() {
            return Ok(base.py().NotImplemented());
        }
        with(base, "power", |x| power(x, self.0))
    }
    fn __neg__(&self) -> Self {
        Self(-self.0)
    }
    fn __pos__(&self) -> Self {
        *self
    }
    fn __abs__(&self) -> Self {
        Self(self.0.abs())
    }
    /// The intersection. Raises `Empty`.
    fn __and__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        let other = interval("other", other)?;
        let both = self.0.intersect(&other);
        both.map(Self).ok_or_else(|| {
            of_sets(SetError::Empty {
                op: "intersection of intervals",
            })
        })
    }
    /// The smallest interval that contains both.
    fn __or__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(self.0.hull(&interval("other", other)?)))
    }
    /// True if it lies in `other`.
    fn is_subset(&self, other: &Self) -> bool {
        self.0.is_subset(other.0)
    }
    #[pyo3(signature = (ufunc, method, *inputs, **kwargs))]
    fn __array_ufunc__<'py>(
        &self,
        ufunc: &Bound<'py, PyAny>,
        method: &Bound<'py, PyAny>,
        inputs: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, pyo3::types::PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let apply = ufunc.py().import("zonobench._ufunc")?.getattr("apply")?;
        apply.call1((ufunc, method, inputs, kwargs))
    }

    /// The angle of (x, self), where it does not jump.
    fn atan2(&self, x: &Bound<'_, PyAny>) -> PyResult<Self> {
        defined("atan2", self.0.atan2(interval("x", x)?))
    }
    /// sqrt(self^2 + y^2).
    fn hypot(&self, y: &Bound<'_, PyAny>) -> PyResult<Self> {
        defined("hypot", self.0.hypot(interval("y", y)?))
    }
    /// The smaller of two.
    fn min(&self, y: &Bound<'_, PyAny>) -> PyResult<Self> {
        defined("min", Real::min(self.0, interval("y", y)?))
    }
    /// The larger of two.
    fn max(&self, y: &Bound<'_, PyAny>) -> PyResult<Self> {
        defined("max", Real::max(self.0, interval("y", y)?))
    }

    /// Encloses x^2 for every number of the interval.
    fn sqr(&self) -> PyResult<Self> {
        defined("sqr", Real::sqr(self.0))
    }
    /// Encloses the square root for every number of the interval.
    fn sqrt(&self) -> PyResult<Self> {
        defined("sqrt", Real::sqrt(self.0))
    }
    /// Encloses e^x for every number of the interval.
    fn exp(&self) -> PyResult<Self> {
        defined("exp", Real::exp(self.0))
    }
    /// Encloses e^x - 1 for every number of the interval.
    fn exp_m1(&self) -> PyResult<Self> {
        defined("exp_m1", Real::exp_m1(self.0))
    }
    /// Encloses the natural logarithm for every number of the interval.
    fn ln(&self) -> PyResult<Self> {
        defined("ln", Real::ln(self.0))
    }
    /// Encloses the logarithm to base 10 for every number of the interval.
    fn log10(&self) -> PyResult<Self> {
        defined("log10", Real::log10(self.0))
    }
    /// Encloses ln(1 + x) for every number of the interval.
    fn ln_1p(&self) -> PyResult<Self> {
        defined("ln_1p", Real::ln_1p(self.0))
    }
    /// Encloses sin x for every number of the interval.
    fn sin(&self) -> PyResult<Self> {
        defined("sin", Real::sin(self.0))
    }
    /// Encloses cos x for every number of the interval.
    fn cos(&self) -> PyResult<Self> {
        defined("cos", Real::cos(self.0))
    }
    /// Encloses tan x for every number of the interval.
    fn tan(&self) -> PyResult<Self> {
        defined("tan", Real::tan(self.0))
    }
    /// Encloses arcsin x for every number of the interval.
    fn asin(&self) -> PyResult<Self> {
        defined("asin", Real::asin(self.0))
    }
    /// Encloses arccos x for every number of the interval.
    fn acos(&self) -> PyResult<Self> {
        defined("acos", Real::acos(self.0))
    }
    /// Encloses arctan x for every number of the interval.
    fn atan(&self) -> PyResult<Self> {
        defined("atan", Real::atan(self.0))
    }
    /// Encloses sinh x for every number of the interval.
    fn sinh(&self) -> PyResult<Self> {
        defined("sinh", Real::sinh(self.0))
    }
    /// Encloses cosh x for every number of the interval.
    fn cosh(&self) -> PyResult<Self> {
        defined("cosh", Real::cosh(self.0))
    }
    /// Encloses tanh x for every number of the interval.
    fn tanh(&self) -> PyResult<Self> {
        defined("tanh", Real::tanh(self.0))
    }
    /// Encloses arsinh x for every number of the interval.
    fn asinh(&self) -> PyResult<Self> {
        defined("asinh", Real::asinh(self.0))
    }
}
