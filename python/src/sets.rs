//! The sets, under one class `Set` that has all that any of them can be asked.
//!
//! What a class adds is what it is made of. Operations on two kinds give the larger kind: a box is a zonotope, a zonotope
//! is a constrained zonotope, and so is a polytope. An ellipsoid belongs to probabilities and mixes with none.

use crate::errors::{Unsupported, error, of_sets};
use crate::interval::PyInterval;
use crate::numbers::{array_1, array_2, matrix, points, room, shaped_2, vector, vector_of};
use numpy::{PyArray1, PyArray2};
use pyo3::PyClass;
use pyo3::exceptions::{PyIndexError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use zonobench_sets::lp::Emptiness;
use zonobench_sets::reduction::scott;
use zonobench_sets::{
    ConstrainedZonotope, Containment, Ellipsoid, Interval, IntervalVector, Matrix, Polytope,
    Reduction, SetError, Slab, Zonotope,
};

/// Any set.
#[derive(Clone, Debug, PartialEq)]
pub enum AnySet {
    /// A box.
    Box(IntervalVector),
    /// A zonotope.
    Zonotope(Zonotope),
    /// A constrained zonotope.
    Constrained(ConstrainedZonotope),
    /// A polytope.
    Polytope(Polytope),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
}

use AnySet::{Box as Sides, Constrained, Zonotope as Zono};

impl AnySet {
    fn dim(&self) -> usize {
        match self {
            Sides(x) => x.dim(),
            Zono(z) => z.dim(),
            Constrained(z) => z.dim(),
            AnySet::Polytope(p) => p.dim(),
            AnySet::Ellipsoid(e) => e.dim(),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Sides(_) => "Box",
            Zono(_) => "Zonotope",
            Constrained(_) => "ConstrainedZonotope",
            AnySet::Polytope(_) => "Polytope",
            AnySet::Ellipsoid(_) => "Ellipsoid",
        }
    }

    /// The size of what its programs work on.
    fn size(&self) -> usize {
        match self {
            Constrained(z) => z.generators() * (z.constraints() + 1),
            AnySet::Polytope(p) => (p.slabs().len() + p.dim()) * (p.slabs().len() + 1),
            _ => 1,
        }
    }

    fn no(&self, what: &str) -> PyErr {
        Unsupported::new_err(format!("{} does not support {what}", self.kind()))
    }

    /// As a constrained zonotope.
    pub fn constrained(&self) -> PyResult<ConstrainedZonotope> {
        match self {
            Sides(x) => ConstrainedZonotope::from_box(x),
            Zono(z) => Ok(z.clone().into()),
            Constrained(z) => Ok(z.clone()),
            AnySet::Polytope(p) => p.to_constrained_zonotope(),
            AnySet::Ellipsoid(_) => {
                return Err(
                    self.no("what sets that are proved can do: it belongs to probabilities")
                );
            }
        }
        .map_err(of_sets)
    }

    /// As a zonotope, where it is one exactly.
    fn zonotope(&self) -> Option<Result<Zonotope, SetError>> {
        match self {
            Sides(x) => Some(Zonotope::from_box(x)),
            Zono(z) => Some(Ok(z.clone())),
            _ => None,
        }
    }

    fn hull(&self) -> Result<IntervalVector, SetError> {
        match self {
            Sides(x) => Ok(x.clone()),
            Zono(z) => z.interval_hull(),
            Constrained(z) => z.interval_hull(),
            AnySet::Polytope(p) => p.to_constrained_zonotope()?.interval_hull(),
            AnySet::Ellipsoid(e) => e.interval_hull(),
        }
    }

    fn affine_map(&self, m: &Matrix, t: &[f64]) -> PyResult<Self> {
        if let Self::Ellipsoid(e) = self {
            let mut c = m.mul_vec(e.c());
            c.iter_mut().zip(t).for_each(|(c, t)| *c += t);
            let p = m.mul(e.p()).mul(&m.transpose()).symmetrized();
            let image = Ellipsoid::new(c.into_vec(), p, e.sigma());
            return image.map(Self::Ellipsoid).map_err(of_sets);
        }
        if let Some(z) = self.zonotope() {
            let image = z.and_then(|z| z.affine_map(m, t));
            return image.map(Zono).map_err(of_sets);
        }
        let image = self.constrained()?.affine_map(m, t);
        image.map(Constrained).map_err(of_sets)
    }

    fn minkowski_sum(&self, other: &Self) -> PyResult<Self> {
        if let (Sides(x), Sides(y)) = (self, other) {
            return x.minkowski_sum(y).map(Sides).map_err(of_sets);
        }
        if let (Some(x), Some(y)) = (self.zonotope(), other.zonotope()) {
            let sum = x.and_then(|x| x.minkowski_sum(&y?));
            return sum.map(Zono).map_err(of_sets);
        }
        let sum = self.constrained()?.minkowski_sum(&other.constrained()?);
        sum.map(Constrained).map_err(of_sets)
    }

    fn translate(&self, t: &[f64]) -> PyResult<Self> {
        let n = self.dim();
        if t.len() != n {
            let got = t.len();
            return Err(error(format!(
                "translation: expected a vector of {n} numbers, got {got}"
            )));
        }
        match self {
            Sides(x) => PyResult::Ok(x.minkowski_sum(&points(t)).map(Sides)),
            Zono(z) => Ok(z.translate(t).map(Zono)),
            Self::Ellipsoid(e) => {
                let c = e.c().iter().zip(t).map(|(c, t)| c + t).collect();
                Ok(Ellipsoid::new(c, e.p().clone(), e.sigma()).map(Self::Ellipsoid))
            }
            _ => Ok(self.constrained()?.translate(t).map(Constrained)),
        }?
        .map_err(of_sets)
    }

    /// { −x }, exact.
    fn negated(&self) -> Result<Self, SetError> {
        let minus = |v: &[f64]| v.iter().map(|x| -x).collect::<Vec<f64>>();
        let zonotope =
            |z: &Zonotope| Zonotope::with_rounding(minus(z.c()), z.g().map(|x| -x), z.r().to_vec());
        Ok(match self {
            Sides(x) => Sides(x.iter().map(|&side| -side).collect()),
            Zono(z) => Zono(zonotope(z)?),
            Constrained(z) => Constrained(ConstrainedZonotope::with_slack(
                zonotope(z.zonotope())?,
                z.a().clone(),
                z.b().to_vec(),
                z.delta().to_vec(),
            )?),
            Self::Polytope(p) => {
                let hull = p.hull().iter().map(|&side| -side).collect();
                let slabs = p.slabs().iter().map(|slab| Slab {
                    normal: minus(&slab.normal),
                    range: slab.range,
                });
                Self::Polytope(Polytope::new(hull, slabs.collect())?)
            }
            Self::Ellipsoid(e) => {
                Self::Ellipsoid(Ellipsoid::new(minus(e.c()), e.p().clone(), e.sigma())?)
            }
        })
    }

    fn intersect(&self, other: &Self, r: Option<&Matrix>) -> PyResult<Self> {
        let both = match (self, other, r) {
            (Sides(x), Sides(y), None) => x.intersect(y).map(Sides),
            (Self::Polytope(x), Self::Polytope(y), None) => x.intersect(y).map(Self::Polytope),
            (Sides(x), Self::Polytope(y), None) | (Self::Polytope(y), Sides(x), None) => {
                y.intersect(&Polytope::from_box(x)).map(Self::Polytope)
            }
            (x, y, None) => x
                .constrained()?
                .intersect(&y.constrained()?)
                .map(Constrained),
            (x, y, Some(r)) => {
                let (x, y) = (x.constrained()?, y.constrained()?);
                let rows = x.constraints() + y.constraints() + y.dim();
                room("intersection", rows, x.generators() + y.generators())?;
                x.generalized_intersection(r, &y).map(Constrained)
            }
        };
        both.map_err(of_sets)
    }

    fn cartesian_product(&self, other: &Self) -> PyResult<Self> {
        if let (Sides(x), Sides(y)) = (self, other) {
            return Ok(Sides(IntervalVector::stack(&[x, y])));
        }
        if let (Some(x), Some(y)) = (self.zonotope(), other.zonotope()) {
            let (x, y) = (x.map_err(of_sets)?, y.map_err(of_sets)?);
            room(
                "Cartesian product",
                x.dim() + y.dim(),
                x.generators() + y.generators(),
            )?;
            return Ok(Zono(x.cartesian_product(&y)));
        }
        let (x, y) = (self.constrained()?, other.constrained()?);
        let columns = x.generators() + y.generators();
        room("Cartesian product", x.dim() + y.dim(), columns)?;
        room(
            "Cartesian product",
            x.constraints() + y.constraints(),
            columns,
        )?;
        Ok(Constrained(x.cartesian_product(&y)))
    }

    fn supports(&self, directions: &[Vec<f64>]) -> PyResult<Vec<f64>> {
        let each = |support: &dyn Fn(&[f64]) -> Result<f64, SetError>| {
            directions
                .iter()
                .map(|d| support(d))
                .collect::<Result<Vec<f64>, _>>()
        };
        match self {
            Sides(x) => {
                let z = Zonotope::from_box(x).map_err(of_sets)?;
                each(&|d| {
                    // Of the box itself, not of the zonotope around it.
                    z.support(d)?;
                    let along = d
                        .iter()
                        .zip(x)
                        .fold(Interval::ZERO, |sum, (&d, &side)| sum + side * d);
                    along.finite("support of a box").map(Interval::hi)
                })
            }
            Zono(z) => each(&|d| z.support(d)),
            Self::Ellipsoid(e) => each(&|d| e.support(d)),
            _ => self.constrained()?.supports(directions),
        }
        .map_err(of_sets)
    }

    fn contains(&self, x: &IntervalVector) -> PyResult<Containment> {
        let n = self.dim();
        if x.dim() != n {
            let got = x.dim();
            return Err(error(format!(
                "containment: expected a point of {n} numbers, got {got}"
            )));
        }
        let sides = x.as_slice();
        match self {
            Sides(outer) => {
                let pairs = || outer.iter().zip(sides);
                Ok(if pairs().any(|(a, x)| a.intersect(x).is_none()) {
                    Containment::Outside
                } else if pairs().all(|(a, x)| a.contains_interval(*x)) {
                    Containment::Inside
                } else {
                    Containment::Undecided
                })
            }
            Zono(z) => match z.contains(sides) {
                Ok(Containment::Undecided) => ConstrainedZonotope::from(z.clone()).contains(sides),
                verdict => verdict,
            },
            Constrained(z) => z.contains(sides),
            Self::Polytope(p) => Ok(p.contains(sides)),
            Self::Ellipsoid(e) => {
                if sides.iter().any(|side| !side.is_point()) {
                    return Err(self.no("the question whether it contains a box"));
                }
                let inside = e.contains(&x.lower());
                inside.map(|inside| match inside {
                    true => Containment::Inside,
                    false => Containment::Outside,
                })
            }
        }
        .map_err(of_sets)
    }

    fn is_empty(&self) -> PyResult<Option<bool>> {
        Ok(match self {
            Sides(_) | Zono(_) | Self::Ellipsoid(_) => Some(false),
            _ => match self.constrained() {
                Ok(z) => match z.emptiness() {
                    Emptiness::Empty => Some(true),
                    Emptiness::NonEmpty(_) => Some(false),
                    Emptiness::Undecided { .. } => None,
                },
                // Two of a polytope's half-spaces along an axis.
                Err(fault) if is_empty_error(&fault) => Some(true),
                Err(fault) => return Err(fault),
            },
        })
    }

    /// The components `which`, in this order, exact.
    fn project(&self, which: &[usize]) -> PyResult<Self> {
        let pick = |v: &[f64]| which.iter().map(|&i| v[i]).collect::<Vec<f64>>();
        let zonotope = |z: &Zonotope| {
            let g = Matrix::from_fn(which.len(), z.generators(), |i, j| z.g()[(which[i], j)]);
            Zonotope::with_rounding(pick(z.c()), g, pick(z.r()))
        };
        match self {
            Sides(x) => Ok(Sides(x.select(which))),
            Zono(z) => zonotope(z).map(Zono),
            Self::Ellipsoid(e) => {
                let p =
                    Matrix::from_fn(which.len(), which.len(), |i, j| e.p()[(which[i], which[j])]);
                Ellipsoid::new(pick(e.c()), p, e.sigma()).map(Self::Ellipsoid)
            }
            _ => {
                let z = self.constrained()?;
                zonotope(z.zonotope())
                    .and_then(|of| {
                        let (b, delta) = (z.b().to_vec(), z.delta().to_vec());
                        ConstrainedZonotope::with_slack(of, z.a().clone(), b, delta)
                    })
                    .map(Constrained)
            }
        }
        .map_err(of_sets)
    }

    fn vertices(&self) -> PyResult<Vec<Vec<f64>>> {
        let n = self.dim();
        if n > 3 {
            return Err(self.no("vertices in more than three dimensions: project it first"));
        }
        let planar = |points: Vec<[f64; 2]>| points.iter().map(|p| p.to_vec()).collect();
        match self {
            Self::Ellipsoid(_) => return Err(self.no("vertices")),
            Sides(x) => Ok(Polytope::from_box(x).vertices().to_vec()),
            Zono(z) if n == 2 => z.vertices().map(planar),
            Self::Polytope(p) if !p.vertices().is_empty() => Ok(p.vertices().to_vec()),
            _ => {
                let z = self.constrained()?;
                if n == 2 {
                    z.vertices().map(planar)
                } else {
                    Polytope::enclosing(&z).map(|p| p.vertices().to_vec())
                }
            }
        }
        .map_err(of_sets)
    }

    fn volume(&self) -> PyResult<Option<f64>> {
        match self {
            Sides(x) => Ok(Some(x.widths().iter().product())),
            Zono(z) if z.dim() <= 3 => Ok(z.volume()),
            Self::Ellipsoid(_) => Err(self.no("a volume")),
            _ if self.dim() > 3 => Ok(None),
            _ => self.constrained()?.volume().map_err(of_sets),
        }
    }
}

fn is_empty_error(fault: &PyErr) -> bool {
    Python::attach(|py| fault.is_instance_of::<crate::errors::Empty>(py))
}

/// A set of points of n numbers: what all sets can be asked, and what can be made of them.
///
/// Sets are immutable; arrays that they give are copies. `M @ X`, `X + Y`, `X + t`, `-X`, `a * X`, `X & Y` and `x in X` are
/// `affine_map`, `minkowski_sum`, translation, scaling, `intersection` and membership. Every set but an ellipsoid contains the
/// exact result for the doubles that came in: roundings are carried outward.
#[pyclass(name = "Set", module = "zonobench", subclass, frozen)]
pub struct PySet(pub AnySet);

/// `set` as an object of its class.
pub fn wrap(py: Python<'_>, set: AnySet) -> PyResult<Py<PyAny>> {
    let kind = set.kind();
    let base = PyClassInitializer::from(PySet(set));
    Ok(match kind {
        "Box" => Py::new(py, base.add_subclass(PyBox))?.into_any(),
        "Zonotope" => Py::new(py, base.add_subclass(PyZonotope))?.into_any(),
        "Polytope" => Py::new(py, base.add_subclass(PyPolytope))?.into_any(),
        "Ellipsoid" => Py::new(py, base.add_subclass(PyEllipsoid))?.into_any(),
        _ => Py::new(py, base.add_subclass(PyConstrained))?.into_any(),
    })
}

/// A point, or a box that holds one.
pub fn located(what: &str, x: &Bound<'_, PyAny>) -> PyResult<IntervalVector> {
    if let Ok(set) = x.cast::<PySet>() {
        return match &set.get().0 {
            Sides(sides) => Ok(sides.clone()),
            other => Err(PyTypeError::new_err(format!(
                "{what}: expected a point, or a Box that holds it, got a {}",
                other.kind()
            ))),
        };
    }
    Ok(points(&vector(what, x)?))
}

/// Runs `work` without the interpreter's lock where it may take more than 50 µs.
fn outside<T: Send>(py: Python<'_>, is_long: bool, work: impl Send + FnOnce() -> T) -> T {
    if is_long { py.detach(work) } else { work() }
}

/// Entries of a set whose programs take about 50 µs.
const LONG: usize = 40;

/// True, False or None as it stands.
pub fn answer(verdict: Containment) -> Option<bool> {
    match verdict {
        Containment::Inside => Some(true),
        Containment::Outside => Some(false),
        Containment::Undecided => None,
    }
}

#[pymethods]
impl PySet {
    /// n, the number of components.
    #[getter]
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other
            .cast::<Self>()
            .is_ok_and(|other| other.get().0 == self.0)
    }

    fn __repr__(&self) -> String {
        let n = self.0.dim();
        match &self.0 {
            Zono(z) => format!("Zonotope({n}-dimensional, {} generators)", z.generators()),
            Constrained(z) => format!(
                "ConstrainedZonotope({n}-dimensional, {} generators, {} constraints)",
                z.generators(),
                z.constraints()
            ),
            AnySet::Polytope(p) => {
                format!("Polytope({n}-dimensional, {} slabs)", p.slabs().len())
            }
            Sides(x) if n <= 4 => {
                let sides: Vec<String> = x
                    .iter()
                    .map(|side| format!("[{:?}, {:?}]", side.lo(), side.hi()))
                    .collect();
                format!("Box({})", sides.join(" x "))
            }
            other => format!("{}({n}-dimensional)", other.kind()),
        }
    }

    /// Encloses { M x + t : x in X }, M m x n, t of m numbers; without t, { M x }.
    ///
    /// A zonotope of a box or a zonotope, a constrained zonotope of what has constraints. Rounding goes into `r`.
    /// Source: [Rego2020, Eq. (3)].
    #[pyo3(signature = (M, t=None))]
    #[allow(non_snake_case)]
    fn affine_map(
        &self,
        py: Python<'_>,
        M: &Bound<'_, PyAny>,
        t: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let m = matrix("M", M)?;
        if m.cols() != self.0.dim() {
            return Err(error(format!(
                "M: expected {} columns, one a component of the set, got {}",
                self.0.dim(),
                m.cols()
            )));
        }
        let t = match t {
            Some(t) => vector_of("t", t, m.rows())?,
            None => vec![0.0; m.rows()],
        };
        let generators = match &self.0 {
            Zono(z) => z.generators(),
            Constrained(z) => z.generators(),
            other => other.dim(),
        };
        room("affine map", m.rows(), generators)?;
        wrap(py, self.0.affine_map(&m, &t)?)
    }

    #[allow(non_snake_case)]
    fn __rmatmul__(&self, py: Python<'_>, M: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        self.affine_map(py, M, None)
    }

    fn __matmul__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let _ = other;
        let _ = py;
        Err(PyTypeError::new_err(
            "X @ M: the matrix stands before the set, M @ X",
        ))
    }

    /// Encloses { x + y : x in X, y in Y }.
    ///
    /// A box of two boxes; a zonotope of boxes and zonotopes; else a constrained zonotope. Source: [Rego2020, Eq. (4)].
    #[allow(non_snake_case)]
    fn minkowski_sum(&self, py: Python<'_>, Y: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        wrap(py, self.0.minkowski_sum(&Y.get().0)?)
    }

    fn __add__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        match other.cast::<Self>() {
            Ok(set) => self.minkowski_sum(py, set),
            Err(_) => wrap(py, self.0.translate(&vector("translation", other)?)?),
        }
    }

    fn __radd__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        self.__add__(py, other)
    }

    fn __sub__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        if other.cast::<Self>().is_ok() {
            return Err(PyTypeError::new_err(
                "X - Y of two sets may mean two things: write X + (-Y) for { x - y }",
            ));
        }
        let minus: Vec<f64> = vector("translation", other)?.iter().map(|t| -t).collect();
        wrap(py, self.0.translate(&minus)?)
    }

    fn __rsub__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let minus = self.0.negated().map_err(of_sets)?;
        wrap(py, minus.translate(&vector("translation", other)?)?)
    }

    fn __neg__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        wrap(py, self.0.negated().map_err(of_sets)?)
    }

    fn __mul__(&self, py: Python<'_>, factor: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        if factor.cast::<Self>().is_ok() {
            return Err(PyTypeError::new_err(
                "X * Y of two sets: write X.cartesian_product(Y) for { (x, y) }",
            ));
        }
        let factor = crate::interval::finite("factor", factor)?;
        if let Sides(x) = &self.0 {
            let scaled: IntervalVector = x.iter().map(|&side| side * factor).collect();
            return wrap(
                py,
                Sides(scaled.finite("scaling of a box").map_err(of_sets)?),
            );
        }
        let n = self.0.dim();
        let m = Matrix::from_fn(n, n, |i, j| if i == j { factor } else { 0.0 });
        wrap(py, self.0.affine_map(&m, &vec![0.0; n])?)
    }

    fn __rmul__(&self, py: Python<'_>, factor: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        self.__mul__(py, factor)
    }

    /// Encloses { x in X : R x in Y }, R m x n for a Y of m components; without R, X and Y.
    ///
    /// A box of two boxes, a polytope of boxes and polytopes, else a constrained zonotope, which may be empty: ask
    /// `is_empty`. Two boxes that do not meet raise `Empty`. Source: [Rego2020, Eq. (5)].
    #[pyo3(signature = (Y, R=None))]
    #[allow(non_snake_case)]
    fn intersection(
        &self,
        py: Python<'_>,
        Y: &Bound<'_, Self>,
        R: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let r = R.map(|r| matrix("R", r)).transpose()?;
        wrap(py, self.0.intersect(&Y.get().0, r.as_ref())?)
    }

    fn __and__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        match other.cast::<Self>() {
            Ok(other) => self.intersection(py, other, None),
            Err(_) => Ok(py.NotImplemented()),
        }
    }

    /// Encloses { x in X : d'x <= s }: a constrained zonotope. Raises `Empty` where the half-space misses the generators' box.
    fn intersect_halfspace(
        &self,
        py: Python<'_>,
        d: &Bound<'_, PyAny>,
        s: &Bound<'_, PyAny>,
    ) -> PyResult<Py<PyAny>> {
        let (d, s) = (
            vector_of("d", d, self.0.dim())?,
            crate::interval::finite("s", s)?,
        );
        let cut = self.0.constrained()?.intersect_halfspace(&d, s);
        wrap(py, Constrained(cut.map_err(of_sets)?))
    }

    /// Encloses { x in X : |d'x - y| <= sigma }: a constrained zonotope.
    fn intersect_strip(
        &self,
        py: Python<'_>,
        d: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        sigma: &Bound<'_, PyAny>,
    ) -> PyResult<Py<PyAny>> {
        let d = vector_of("d", d, self.0.dim())?;
        let y = crate::interval::finite("y", y)?;
        let sigma = crate::interval::finite("sigma", sigma)?;
        let cut = self.0.constrained()?.intersect_strip(&d, y, sigma);
        wrap(py, Constrained(cut.map_err(of_sets)?))
    }

    /// { (x, y) : x in X, y in Y }, exact.
    #[allow(non_snake_case)]
    fn cartesian_product(&self, py: Python<'_>, Y: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        wrap(py, self.0.cartesian_product(&Y.get().0)?)
    }

    /// An upper bound on max { d'x : x in X }, which is the maximum up to rounding: a number for a direction d of n numbers, an
    /// array of k for the k rows of a k x n matrix. Of an ellipsoid, rounded to nearest. Raises `Empty`.
    fn support<'py>(&self, py: Python<'py>, d: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.0.dim();
        let many = crate::numbers::dimensions("d", d)? == 2;
        let directions: Vec<Vec<f64>> = if many {
            let m = matrix("d", d)?;
            (0..m.rows()).map(|i| m.row(i).to_vec()).collect()
        } else {
            vec![vector("d", d)?]
        };
        if let Some(wrong) = directions.iter().find(|d| d.len() != n) {
            let got = wrong.len();
            return Err(error(format!(
                "d: expected {n} numbers, one a component of the set, got {got}"
            )));
        }
        let is_long = self.0.size() * directions.len() > LONG;
        let bounds = outside(py, is_long, || self.0.supports(&directions))?;
        if many {
            Ok(array_1(py, &bounds).into_any())
        } else {
            Ok(bounds[0].into_pyobject(py)?.into_any())
        }
    }

    /// The smallest `Box` that contains the set, each bound proved. Raises `Empty`.
    fn bounding_box(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let hull = outside(py, self.0.size() > LONG, || self.0.hull());
        wrap(py, Sides(hull.map_err(of_sets)?))
    }

    /// True if the set is proved empty, False if it is proved to hold a point (up to the rounding of its equations), None if
    /// neither could be shown.
    fn is_empty(&self, py: Python<'_>) -> PyResult<Option<bool>> {
        outside(py, self.0.size() > LONG, || self.0.is_empty())
    }

    /// True if x is proved to be in the set, False if it is proved not to be, None if neither could be shown.
    ///
    /// x: a point of n numbers, or a `Box` that holds it; then the answer is about each of the box's points. True of a
    /// constrained zonotope is up to the rounding of its equations, which no double solves exactly.
    fn contains(&self, py: Python<'_>, x: &Bound<'_, PyAny>) -> PyResult<Option<bool>> {
        let x = located("x", x)?;
        let verdict = outside(py, self.0.size() > LONG, || self.0.contains(&x))?;
        Ok(answer(verdict))
    }

    fn __contains__(&self, py: Python<'_>, x: &Bound<'_, PyAny>) -> PyResult<bool> {
        Ok(self.contains(py, x)? == Some(true))
    }

    /// { (x_i, x_j, ...) : x in X } for the components given, counted from 0; exact.
    #[pyo3(signature = (*components))]
    fn project(&self, py: Python<'_>, components: &Bound<'_, PyTuple>) -> PyResult<Py<PyAny>> {
        let n = self.0.dim();
        let which = components.iter().map(|i| {
            let i: isize = i.extract().map_err(|_| {
                PyTypeError::new_err(
                    "project: expected the numbers of components, as project(0, 2)",
                )
            })?;
            let at = if i < 0 { i + n as isize } else { i };
            usize::try_from(at)
                .ok()
                .filter(|&at| at < n)
                .ok_or_else(|| {
                    PyIndexError::new_err(format!(
                        "project: the set has no component {i}, it has {n}"
                    ))
                })
        });
        let which = which.collect::<PyResult<Vec<usize>>>()?;
        if which.is_empty() {
            return Err(error(
                "project: expected the numbers of components, got none",
            ));
        }
        wrap(py, self.0.project(&which)?)
    }

    /// The vertices as rows, for n <= 3: counter-clockwise in the plane. Rounded to nearest, for drawing; no bound.
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let n = self.0.dim();
        let vertices = outside(py, self.0.size() > LONG, || self.0.vertices())?;
        shaped_2(py, vertices.concat(), [vertices.len(), n])
    }

    /// Length, area or volume for n = 1, 2, 3, rounded to nearest; None where it is not known.
    fn volume(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        outside(py, self.0.size() > LONG, || self.0.volume())
    }

    /// A set of at most so many generators (and constraints) that contains this one.
    ///
    /// method, of a zonotope: "girard" or "combastel". Of a constrained zonotope: Scott's elimination of constraints, then of
    /// generators; generators >= n + constraints. Source: Scott et al., Automatica 2016.
    #[pyo3(signature = (generators, constraints=None, method="girard"))]
    fn reduce(
        &self,
        py: Python<'_>,
        generators: usize,
        constraints: Option<usize>,
        method: &str,
    ) -> PyResult<Py<PyAny>> {
        let by = match method {
            "girard" => Reduction::Girard,
            "combastel" => Reduction::Combastel,
            other => {
                return Err(error(format!(
                    "reduce: expected the method \"girard\" or \"combastel\", got {other:?}"
                )));
            }
        };
        let reduced = match &self.0 {
            Sides(_) => Ok(self.0.clone()),
            Zono(z) => by.reduce_order(z, generators).map(Zono),
            AnySet::Ellipsoid(_) => return Err(self.0.no("a reduction")),
            _ => {
                let z = self.0.constrained()?.fold();
                let constraints = constraints.unwrap_or(z.constraints());
                outside(py, true, || scott::reduce(&z, generators, constraints)).map(Constrained)
            }
        };
        wrap(py, reduced.map_err(of_sets)?)
    }

    /// The same set with its rounding box `r` (and slack `delta`) made generators, exact.
    fn fold(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let folded = match &self.0 {
            Zono(z) => Zono(z.clone().fold()),
            Constrained(z) => Constrained(z.clone().fold()),
            other => other.clone(),
        };
        wrap(py, folded)
    }

    /// The set as a `Zonotope`: of a box, a zonotope that contains it. Raises `Unsupported` where there are constraints.
    fn to_zonotope(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        match self.0.zonotope() {
            Some(z) => wrap(py, Zono(z.map_err(of_sets)?)),
            None => Err(self.0.no("being a zonotope: see bounding_box and reduce")),
        }
    }

    /// The set as a `ConstrainedZonotope`.
    fn to_constrained_zonotope(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        wrap(py, Constrained(self.0.constrained()?))
    }

    /// The smallest `Polytope` that contains the set, for n <= 3: its facets, each offset a proved support.
    fn to_polytope(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let polytope = match &self.0 {
            Sides(x) => Ok(Polytope::from_box(x)),
            AnySet::Polytope(p) => Ok(p.clone()),
            other => {
                let z = other.constrained()?;
                py.detach(|| Polytope::enclosing(&z))
            }
        };
        wrap(py, AnySet::Polytope(polytope.map_err(of_sets)?))
    }
}

/// The set behind an object of a subclass.
fn inner<'a, 'py, T: PyClass>(of: &'a Bound<'py, T>) -> &'a AnySet {
    let set = of.as_any().cast::<PySet>();
    &set.expect("its class extends Set").get().0
}

/// Box(lower, upper): { x : lower <= x <= upper }, componentwise.
///
/// `x[i]` is side i, an `Interval`.
///
/// lower, upper: n finite numbers each, lower <= upper.
#[pyclass(name = "Box", module = "zonobench", extends = PySet, frozen)]
pub struct PyBox;

fn sides<'a>(of: &'a Bound<'_, PyBox>) -> &'a IntervalVector {
    match inner(of) {
        Sides(x) => x,
        _ => unreachable!("a Box holds a box"),
    }
}

#[pymethods]
impl PyBox {
    #[new]
    fn new(
        lower: &Bound<'_, PyAny>,
        upper: &Bound<'_, PyAny>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (lower, upper) = (vector("lower", lower)?, vector("upper", upper)?);
        if lower.is_empty() {
            return Err(error("box: expected at least one side, got none"));
        }
        let sides = IntervalVector::from_bounds(&lower, &upper).map_err(of_sets)?;
        Ok(PyClassInitializer::from(PySet(Sides(sides))).add_subclass(Self))
    }

    /// A box that contains { x : |x - center| <= radius }, bounds rounded outward.
    #[staticmethod]
    fn from_center_radius(
        py: Python<'_>,
        center: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
    ) -> PyResult<Py<PyAny>> {
        let (center, radius) = (vector("center", center)?, vector("radius", radius)?);
        if center.is_empty() {
            return Err(error("box: expected at least one side, got none"));
        }
        let sides = IntervalVector::from_center_radius(&center, &radius).map_err(of_sets)?;
        wrap(py, Sides(sides))
    }

    /// The lower bounds, n numbers.
    #[getter]
    fn lower<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), &sides(slf).lower())
    }
    /// The upper bounds, n numbers.
    #[getter]
    fn upper<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), &sides(slf).upper())
    }
    /// A point of the box near its middle.
    #[getter]
    fn mid<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), &sides(slf).mid())
    }
    /// Upper bounds on the distances from `mid`, componentwise.
    #[getter]
    fn rad<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), &sides(slf).rad())
    }
    /// Upper bounds on upper - lower.
    #[getter]
    fn widths<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), &sides(slf).widths())
    }

    fn __len__(slf: &Bound<'_, Self>) -> usize {
        sides(slf).dim()
    }
    fn __getitem__(slf: &Bound<'_, Self>, i: isize) -> PyResult<PyInterval> {
        let x = sides(slf);
        let at = if i < 0 { i + x.dim() as isize } else { i };
        match usize::try_from(at).ok().filter(|&at| at < x.dim()) {
            Some(at) => Ok(PyInterval(x[at])),
            None => Err(PyIndexError::new_err(format!(
                "box: it has no side {i}, it has {}",
                x.dim()
            ))),
        }
    }
    /// The smallest box that contains both.
    fn __or__(slf: &Bound<'_, Self>, other: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        let hull = sides(slf).hull(sides(other)).map_err(of_sets)?;
        wrap(slf.py(), Sides(hull))
    }
    /// True if every point of the box is in `other`, a box.
    fn is_subset(slf: &Bound<'_, Self>, other: &Bound<'_, Self>) -> bool {
        sides(other).contains_box(sides(slf))
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, Arrays<'py, 2>) {
        let bounds = [Self::lower(slf), Self::upper(slf)].map(Bound::into_any);
        (slf.get_type().into_any(), Arrays(bounds))
    }
}

/// A tuple of arrays.
struct Arrays<'py, const N: usize>([Bound<'py, PyAny>; N]);

impl<'py, const N: usize> IntoPyObject<'py> for Arrays<'py, N> {
    type Target = PyTuple;
    type Output = Bound<'py, PyTuple>;
    type Error = PyErr;
    fn into_pyobject(self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0)
    }
}

/// Zonotope(c, G, r=None): { c + G xi + s : |xi| <= 1, |s| <= r }.
///
/// c: n numbers; G: n x p; r: n numbers >= 0, the rounding box, 0 unless given. Operations put their rounding into r; `fold`
/// makes it generators.
#[pyclass(name = "Zonotope", module = "zonobench", extends = PySet, frozen)]
pub struct PyZonotope;

fn generated(
    c: &Bound<'_, PyAny>,
    g: &Bound<'_, PyAny>,
    r: Option<&Bound<'_, PyAny>>,
) -> PyResult<Zonotope> {
    let (c, g) = (vector("c", c)?, matrix("G", g)?);
    if g.rows() != c.len() {
        return Err(error(format!(
            "G: expected {} rows, one a component of c, got {}",
            c.len(),
            g.rows()
        )));
    }
    let r = match r {
        Some(r) => vector_of("r", r, c.len())?,
        None => vec![0.0; c.len()],
    };
    Zonotope::with_rounding(c, g, r).map_err(of_sets)
}

fn zonotope_of<'a, T: PyClass>(of: &'a Bound<'_, T>) -> &'a Zonotope {
    match inner(of) {
        Zono(z) => z,
        Constrained(z) => z.zonotope(),
        _ => unreachable!("a Zonotope holds a zonotope, a ConstrainedZonotope a constrained one"),
    }
}

#[pymethods]
impl PyZonotope {
    #[new]
    #[pyo3(signature = (c, G, r=None))]
    #[allow(non_snake_case)]
    fn new(
        c: &Bound<'_, PyAny>,
        G: &Bound<'_, PyAny>,
        r: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let z = generated(c, G, r)?;
        Ok(PyClassInitializer::from(PySet(Zono(z))).add_subclass(Self))
    }
    /// The center c, n numbers.
    #[getter]
    fn c<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), zonotope_of(slf).c())
    }
    /// The generators G, n x p.
    #[getter(G)]
    fn g<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array_2(slf.py(), zonotope_of(slf).g())
    }
    /// The half-widths r of the rounding box, n numbers.
    #[getter]
    fn r<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), zonotope_of(slf).r())
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Arrays<'py, 3>)> {
        let parts = [
            Self::c(slf).into_any(),
            Self::g(slf)?.into_any(),
            Self::r(slf).into_any(),
        ];
        Ok((slf.get_type().into_any(), Arrays(parts)))
    }
}

/// ConstrainedZonotope(c, G, A, b, r=None, delta=None): { c + G xi + s : |xi| <= 1, |A xi - b| <= delta, |s| <= r }.
///
/// c: n numbers; G: n x p; A: q x p; b: q numbers; r and delta: the rounding box and the slack, n and q numbers >= 0, 0 unless
/// given. Source: Scott et al., Automatica 2016.
#[pyclass(name = "ConstrainedZonotope", module = "zonobench", extends = PySet, frozen)]
pub struct PyConstrained;

fn constrained_of<'a>(of: &'a Bound<'_, PyConstrained>) -> &'a ConstrainedZonotope {
    match inner(of) {
        Constrained(z) => z,
        _ => unreachable!("a ConstrainedZonotope holds a constrained zonotope"),
    }
}

#[pymethods]
impl PyConstrained {
    #[new]
    #[pyo3(signature = (c, G, A, b, r=None, delta=None))]
    #[allow(non_snake_case)]
    fn new(
        c: &Bound<'_, PyAny>,
        G: &Bound<'_, PyAny>,
        A: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        r: Option<&Bound<'_, PyAny>>,
        delta: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let z = generated(c, G, r)?;
        let (a, b) = (matrix("A", A)?, vector("b", b)?);
        let a = match a.rows() {
            0 => Matrix::zeros(0, z.generators()),
            _ => a,
        };
        if a.cols() != z.generators() {
            return Err(error(format!(
                "A: expected {} columns, one a generator, got {}",
                z.generators(),
                a.cols()
            )));
        }
        if b.len() != a.rows() {
            let (expected, got) = (a.rows(), b.len());
            return Err(error(format!(
                "b: expected {expected} numbers, one a row of A, got {got}"
            )));
        }
        let delta = match delta {
            Some(delta) => vector_of("delta", delta, b.len())?,
            None => vec![0.0; b.len()],
        };
        let set = ConstrainedZonotope::with_slack(z, a, b, delta).map_err(of_sets)?;
        Ok(PyClassInitializer::from(PySet(Constrained(set))).add_subclass(Self))
    }
    /// The center c of the generators, n numbers; it need not lie in the set.
    #[getter]
    fn c<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), zonotope_of(slf).c())
    }
    /// The generators G, n x p.
    #[getter(G)]
    fn g<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array_2(slf.py(), zonotope_of(slf).g())
    }
    /// The constraints' coefficients A, q x p.
    #[getter(A)]
    fn a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array_2(slf.py(), constrained_of(slf).a())
    }
    /// The constraints' right side b, q numbers.
    #[getter]
    fn b<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), constrained_of(slf).b())
    }
    /// The half-widths r of the rounding box, n numbers.
    #[getter]
    fn r<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), zonotope_of(slf).r())
    }
    /// The slack delta of the constraints, q numbers.
    #[getter]
    fn delta<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), constrained_of(slf).delta())
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Arrays<'py, 6>)> {
        let parts = [
            Self::c(slf).into_any(),
            Self::g(slf)?.into_any(),
            Self::a(slf)?.into_any(),
            Self::b(slf).into_any(),
            Self::r(slf).into_any(),
            Self::delta(slf).into_any(),
        ];
        Ok((slf.get_type().into_any(), Arrays(parts)))
    }
}

/// Polytope(box, A=None, b=None, lower=None): { x in box : lower <= A x <= b }.
///
/// box: a `Box`, which makes it bounded; A: m x n; b: m numbers; lower: m numbers, unless given what the box allows. Without A,
/// the box. See `Set.to_polytope` for the polytope around another set.
#[pyclass(name = "Polytope", module = "zonobench", extends = PySet, frozen)]
pub struct PyPolytope;

fn polytope_of<'a>(of: &'a Bound<'_, PyPolytope>) -> &'a Polytope {
    match inner(of) {
        AnySet::Polytope(p) => p,
        _ => unreachable!("a Polytope holds a polytope"),
    }
}

#[pymethods]
impl PyPolytope {
    #[new]
    #[pyo3(signature = (r#box, A=None, b=None, lower=None))]
    #[allow(non_snake_case)]
    fn new(
        r#box: &Bound<'_, PyAny>,
        A: Option<&Bound<'_, PyAny>>,
        b: Option<&Bound<'_, PyAny>>,
        lower: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let hull = match r#box.cast::<PyBox>() {
            Ok(of) => sides(of).clone(),
            Err(_) => return Err(PyTypeError::new_err("box: expected a Box")),
        };
        let Some(a) = A else {
            if b.is_some() || lower.is_some() {
                return Err(error("polytope: expected A beside b and lower, got none"));
            }
            let polytope = Polytope::from_box(&hull);
            let base = PyClassInitializer::from(PySet(AnySet::Polytope(polytope)));
            return Ok(base.add_subclass(Self));
        };
        let a = matrix("A", a)?;
        if a.cols() != hull.dim() {
            let (expected, got) = (hull.dim(), a.cols());
            return Err(error(format!(
                "A: expected {expected} columns, one a side of the box, got {got}"
            )));
        }
        let b = match b {
            Some(b) => vector_of("b", b, a.rows())?,
            None => return Err(error("polytope: expected b beside A, got none")),
        };
        let lower = lower.map(|l| vector_of("lower", l, a.rows())).transpose()?;
        let mut slabs = Vec::new();
        for (i, &upper) in b.iter().enumerate() {
            let normal = a.row(i).to_vec();
            if normal.iter().all(|&x| x == 0.0) {
                return Err(error(format!(
                    "A: expected rows that are not zero, row {i} is"
                )));
            }
            let product = Slab {
                normal: normal.clone(),
                range: Interval::ZERO,
            }
            .product(hull.as_slice());
            let least = lower.as_ref().map_or(product.lo(), |lower| lower[i]);
            let range = if lower.is_none() && least > upper {
                return Err(of_sets(SetError::Empty { op: "polytope" }));
            } else {
                Interval::new(least, upper).map_err(of_sets)?
            };
            slabs.push(Slab { normal, range });
        }
        let polytope = Polytope::new(hull, slabs).map_err(of_sets)?;
        Ok(PyClassInitializer::from(PySet(AnySet::Polytope(polytope))).add_subclass(Self))
    }
    /// The `Box` that the half-spaces cut.
    #[getter]
    fn r#box(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        wrap(slf.py(), Sides(polytope_of(slf).hull().clone()))
    }
    /// The normals A as rows, m x n.
    #[getter(A)]
    fn a<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (slabs, n) = (polytope_of(slf).slabs(), polytope_of(slf).dim());
        array_2(
            slf.py(),
            &Matrix::from_fn(slabs.len(), n, |i, j| slabs[i].normal[j]),
        )
    }
    /// The upper bounds b of A x, m numbers.
    #[getter]
    fn b<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        let upper: Vec<f64> = polytope_of(slf)
            .slabs()
            .iter()
            .map(|s| s.range.hi())
            .collect();
        array_1(slf.py(), &upper)
    }
    /// The lower bounds of A x, m numbers.
    #[getter]
    fn lower<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        let lower: Vec<f64> = polytope_of(slf)
            .slabs()
            .iter()
            .map(|s| s.range.lo())
            .collect();
        array_1(slf.py(), &lower)
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Arrays<'py, 4>)> {
        let py = slf.py();
        let parts = [
            Self::r#box(slf)?.into_bound(py),
            Self::a(slf)?.into_any(),
            Self::b(slf).into_any(),
            Self::lower(slf).into_any(),
        ];
        Ok((slf.get_type().into_any(), Arrays(parts)))
    }
}

/// Ellipsoid(c, P, sigma=1.0): { x : (x - c)' P^-1 (x - c) <= sigma }.
///
/// c: n numbers; P: n x n, symmetric positive semidefinite; sigma >= 0. Belongs to probabilities: nothing is rounded outward.
#[pyclass(name = "Ellipsoid", module = "zonobench", extends = PySet, frozen)]
pub struct PyEllipsoid;

fn ellipsoid_of<'a>(of: &'a Bound<'_, PyEllipsoid>) -> &'a Ellipsoid {
    match inner(of) {
        AnySet::Ellipsoid(e) => e,
        _ => unreachable!("an Ellipsoid holds an ellipsoid"),
    }
}

#[pymethods]
impl PyEllipsoid {
    #[new]
    #[pyo3(signature = (c, P, sigma=None))]
    #[allow(non_snake_case)]
    fn new(
        c: &Bound<'_, PyAny>,
        P: &Bound<'_, PyAny>,
        sigma: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let sigma = sigma.map_or(Ok(1.0), |sigma| crate::interval::finite("sigma", sigma))?;
        let ellipsoid = Ellipsoid::new(vector("c", c)?, matrix("P", P)?, sigma);
        let set = AnySet::Ellipsoid(ellipsoid.map_err(of_sets)?);
        Ok(PyClassInitializer::from(PySet(set)).add_subclass(Self))
    }
    /// The ellipsoid that holds c + g, g ~ N(0, P), with probability 1 - alpha.
    #[staticmethod]
    #[allow(non_snake_case)]
    fn with_confidence(
        py: Python<'_>,
        c: &Bound<'_, PyAny>,
        P: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
    ) -> PyResult<Py<PyAny>> {
        let alpha = crate::interval::finite("alpha", alpha)?;
        let ellipsoid = Ellipsoid::with_confidence(vector("c", c)?, matrix("P", P)?, alpha);
        wrap(py, AnySet::Ellipsoid(ellipsoid.map_err(of_sets)?))
    }
    /// The center c, n numbers.
    #[getter]
    fn c<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        array_1(slf.py(), ellipsoid_of(slf).c())
    }
    /// The shape P, n x n.
    #[getter(P)]
    fn p<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array_2(slf.py(), ellipsoid_of(slf).p())
    }
    /// The level sigma.
    #[getter]
    fn sigma(slf: &Bound<'_, Self>) -> f64 {
        ellipsoid_of(slf).sigma()
    }
    /// (x - c)' P^-1 (x - c).
    fn squared_distance(slf: &Bound<'_, Self>, x: &Bound<'_, PyAny>) -> PyResult<f64> {
        let x = vector_of("x", x, ellipsoid_of(slf).dim())?;
        ellipsoid_of(slf).squared_distance(&x).map_err(of_sets)
    }
    /// Points of the boundary as rows, for n = 2.
    #[pyo3(signature = (points=64))]
    fn outline<'py>(slf: &Bound<'py, Self>, points: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        room("outline", points, 2)?;
        let outline = ellipsoid_of(slf).outline(points).map_err(of_sets)?;
        shaped_2(slf.py(), outline.concat(), [points, 2])
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Arrays<'py, 3>)> {
        let sigma = Self::sigma(slf).into_pyobject(slf.py())?.into_any();
        let parts = [Self::c(slf).into_any(), Self::p(slf)?.into_any(), sigma];
        Ok((slf.get_type().into_any(), Arrays(parts)))
    }
}

/// Puts the classes into the module; numpy leaves operators with a set to the set.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add_class::<PySet>()?;
    module.add_class::<PyBox>()?;
    module.add_class::<PyZonotope>()?;
    module.add_class::<PyConstrained>()?;
    module.add_class::<PyPolytope>()?;
    module.add_class::<PyEllipsoid>()?;
    let none: Option<&Bound<'_, PyDict>> = None;
    py.get_type::<PySet>().setattr("__array_ufunc__", none)
}
