//! What the set-membership filters of nonlinear systems share: the sets a problem gives, the linear
//! measurement equation y = C x + D_v v + h(k, 0, u, 0), and beliefs that are sets.

use crate::error::finite_vector;
use crate::estimator::{Belief, Containment, Measurement, Shape, Size};
use crate::propagation::Dynamics;
use crate::system::{AnySystem, System};
use crate::{EstimationError, Problem, Uncertain};
use std::sync::OnceLock;
use zonobench_sets::interval_matrix::jacobian_over;
use zonobench_sets::lp::{LinearProgram, Work};
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{
    ConstrainedZonotope, Interval, IntervalVector, List, Matrix, SetError, Zonotope,
};

use super::linear_output::check_measurement;

/// The set part of `part`, which must have one.
pub(super) fn set_of(
    kind: &'static str,
    key: &'static str,
    part: &Uncertain,
) -> Result<ConstrainedZonotope, EstimationError> {
    if !part.has_set() && part.has_gaussian() {
        return Err(EstimationError::setting(
            kind,
            key,
            "a set (box or generators)",
            "a covariance alone",
        ));
    }
    let g = part.generator_matrix();
    let (a, b) = part
        .constraints
        .clone()
        .unwrap_or_else(|| (Matrix::zeros(0, g.cols()), Vec::new()));
    ConstrainedZonotope::new(part.center.clone(), g, a, b)
        .map_err(EstimationError::at(0, "assumed set"))
}

/// A system whose measurement is linear, with the sets of its noises.
#[derive(Clone, Debug)]
pub(super) struct Model {
    kind: &'static str,
    pub system: AnySystem,
    /// X_0.
    pub prior: ConstrainedZonotope,
    /// W.
    pub w: ConstrainedZonotope,
    /// V; none where there is no measurement noise.
    v: Option<ConstrainedZonotope>,
    n_u: usize,
    c: Matrix,
    d_v: Matrix,
    /// Whether C and D_v are the same at every step and input: those that the system knows, and those of every
    /// system with equations of its own in this crate. Else they are taken anew for each measurement.
    fixed: bool,
}

/// (x, v) ↦ h(k, x, u, v).
struct Output<'a> {
    system: &'a AnySystem,
    k: usize,
    u: &'a [f64],
    n: usize,
    n_y: usize,
    n_v: usize,
}

impl Function for Output<'_> {
    fn inputs(&self) -> usize {
        self.n + self.n_v
    }
    fn outputs(&self) -> usize {
        self.n_y
    }
    fn evaluate<S: Real>(&self, z: &[S], y: &mut [S]) {
        self.system.h(self.k, &z[..self.n], self.u, &z[self.n..], y);
    }
}

impl Output<'_> {
    /// C and D_v where h is C x + D_v v + h(k, 0, u, 0) with f64 coefficients at this k and u.
    ///
    /// A linear function has the same derivative over any box: points, not intervals. One that is not defined
    /// everywhere is not linear either.
    fn coefficients(&self) -> Option<(Matrix, Matrix)> {
        let (n, all) = (self.n, self.n + self.n_v);
        let anywhere = IntervalVector::new(List::filled(Interval::UNIT, all));
        let (_, j) = jacobian_over(self, &anywhere).ok()?;
        let columns =
            |from: usize, to: usize| j.select_columns(&(from..to).collect::<List<_>>()).mid();
        j.as_slice()
            .iter()
            .all(|e| e.is_point())
            .then(|| (columns(0, n), columns(n, all)))
    }
}

impl Model {
    /// Fails where a part has no set, or the measurement at k = 0 and u = 0 is not linear in x and v.
    pub fn new(kind: &'static str, problem: &Problem) -> Result<Self, EstimationError> {
        let variables = problem.system.variables();
        let (n, n_y, n_v) = (variables.x.len(), variables.y.len(), variables.v.len());
        let u = List::filled(0.0, variables.u.len());
        let unsupported = |reason: &str| EstimationError::Unsupported {
            kind,
            what: problem.system.kind(),
            reason: reason.into(),
        };
        if problem.system.n_delta() > 0 {
            return Err(unsupported("it knows no parameters δ"));
        }
        let known = match problem.system.quasi_lpv() {
            Some(form) => Some((form.output_matrix(), Matrix::identity(n_y))),
            None => problem.system.linear_output(),
        };
        let fixed = known.is_some() || !matches!(problem.system, AnySystem::Equations(_));
        let at_start = Output {
            system: &problem.system,
            k: 0,
            u: &u,
            n,
            n_y,
            n_v,
        };
        let (c, d_v) = known
            .or_else(|| at_start.coefficients())
            .ok_or_else(|| unsupported("it needs a measurement linear in x and v"))?;
        Ok(Self {
            kind,
            fixed,
            prior: set_of(kind, "prior", &problem.prior)?,
            w: set_of(kind, "noise.w", &problem.w)?,
            v: (n_v > 0)
                .then(|| set_of(kind, "noise.v", &problem.v))
                .transpose()?,
            n_u: u.len(),
            c,
            d_v,
            system: problem.system.clone(),
        })
    }

    /// f from step `k` to `k` + 1 under `u`. Fails where `u` is not an input.
    pub fn dynamics<'a>(
        &'a self,
        k: usize,
        u: &'a [f64],
    ) -> Result<Dynamics<'a, AnySystem>, EstimationError> {
        self.check_input(u)?;
        let (n, n_w) = (self.prior.dim(), self.w.dim());
        Ok(Dynamics::of_sizes(&self.system, k, u, n, n_w))
    }

    fn check_input(&self, u: &[f64]) -> Result<(), EstimationError> {
        finite_vector("input u", u, self.n_u)
    }

    /// The rows of C that were measured, and the set y − h(k, 0, u, 0) − D_v V that C x lies in.
    ///
    /// Fails with `Refused` where the measurement is linear at the start and not at this step and input, or has
    /// coefficients there that are no f64s.
    pub fn observe(
        &self,
        k: usize,
        u: &[f64],
        y: Measurement,
    ) -> Result<Option<(Matrix, ConstrainedZonotope)>, EstimationError> {
        self.check_input(u)?;
        check_measurement(y, self.c.rows())?;
        let rows: List<usize> = (0..y.len()).filter(|&i| y[i].is_some()).collect();
        if rows.is_empty() {
            return Ok(None);
        }
        let (n, n_y, n_v) = (self.c.cols(), self.c.rows(), self.d_v.cols());
        let mut offset = List::filled(Interval::ZERO, n_y);
        let output = Output {
            system: &self.system,
            k,
            u,
            n,
            n_y,
            n_v,
        };
        output.evaluate(&List::filled(Interval::ZERO, n + n_v), &mut offset);
        let moved;
        let (c, d_v) = if self.fixed {
            (&self.c, &self.d_v)
        } else {
            moved = output
                .coefficients()
                .ok_or_else(|| EstimationError::Refused {
                    k,
                    kind: self.kind,
                    reason: "the measurement is not linear in x and v with coefficients that are f64s at this \
                             step and input"
                        .into(),
                })?;
            (&moved.0, &moved.1)
        };
        let select = |m: &Matrix| Matrix::from_fn(rows.len(), m.cols(), |i, j| m[(rows[i], j)]);
        let known: List<Interval> = rows
            .iter()
            .filter_map(|&i| y[i].map(|y| Interval::point(y) - offset[i]))
            .collect();
        let middle: List<f64> = known.iter().map(|x| x.mid()).collect();
        let rounding: List<f64> = known.iter().map(|x| x.rad()).collect();
        let target = match &self.v {
            Some(v) => v.affine_map(&select(d_v).scale(-1.0), &middle),
            None => Zonotope::new(middle, Matrix::zeros(rows.len(), 0)).map(Into::into),
        };
        let target = target.and_then(|t| t.widened_by(&rounding));
        Ok(Some((
            select(c),
            target.map_err(EstimationError::at(k, "measurement"))?,
        )))
    }
}

/// A zonotope that contains x_k.
#[derive(Clone, Debug, PartialEq)]
pub struct ZonotopeBelief {
    pub(super) set: Zonotope,
}

impl ZonotopeBelief {
    /// The set.
    pub fn set(&self) -> &Zonotope {
        &self.set
    }
}

impl From<Zonotope> for ZonotopeBelief {
    fn from(set: Zonotope) -> Self {
        Self { set }
    }
}

fn radius(hull: Option<&IntervalVector>) -> Option<f64> {
    hull.map(|hull| hull.rad().iter().copied().fold(0.0, f64::max))
}

impl Belief for ZonotopeBelief {
    fn center(&self) -> Vec<f64> {
        self.set.c().to_vec()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        self.set.interval_hull().ok()
    }
    fn contains(&self, x: &[Interval]) -> Containment {
        let verdict = self.set.contains(x);
        match verdict {
            Ok(Containment::Undecided) => ConstrainedZonotope::from(self.set.clone())
                .contains(x)
                .unwrap_or(Containment::Undecided),
            verdict => verdict.unwrap_or(Containment::Undecided),
        }
    }
    fn covariance(&self) -> Option<&Matrix> {
        None
    }
    fn size(&self) -> Size {
        Size {
            n_generators: Some(self.set.generators()),
            trace_ggt: Some(self.set.trace_ggt()),
            radius: radius(self.interval_hull().as_ref()),
            volume: if self.set.dim() <= 3 {
                self.set.volume()
            } else {
                None
            },
            ..Size::default()
        }
    }
    fn shape(&self) -> Shape {
        Shape {
            kind: "zonotope",
            center: self.center(),
            generators: Some(self.set.g().clone()),
            ..Shape::default()
        }
    }
}

/// A constrained zonotope that contains x_k. Its hull is computed when first asked for.
#[derive(Clone, Debug)]
pub struct ConstrainedBelief {
    pub(super) set: ConstrainedZonotope,
    hull: OnceLock<Option<IntervalVector>>,
    /// Programs and pivots that made the set (and its hull, where that was needed).
    work: Work,
}

impl ConstrainedBelief {
    pub(super) fn new(set: ConstrainedZonotope, work: Work) -> Self {
        Self {
            set,
            hull: OnceLock::new(),
            work,
        }
    }

    /// With the hull known, because the next prediction needs it.
    pub(super) fn with_hull(
        set: ConstrainedZonotope,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        let hull = set.interval_hull_with(lp)?;
        Ok(Self {
            set,
            hull: OnceLock::from(Some(hull)),
            work: lp.work(),
        })
    }

    /// The set.
    pub fn set(&self) -> &ConstrainedZonotope {
        &self.set
    }

    /// The interval hull; an error where the set is empty or unbounded.
    pub(super) fn hull(&self) -> Result<IntervalVector, SetError> {
        match self.hull.get_or_init(|| self.set.interval_hull().ok()) {
            Some(hull) => Ok(hull.clone()),
            None => self.set.interval_hull(),
        }
    }
}

impl From<ConstrainedZonotope> for ConstrainedBelief {
    fn from(set: ConstrainedZonotope) -> Self {
        Self::new(set, Work::default())
    }
}

impl Belief for ConstrainedBelief {
    /// The center of the interval hull: c need not lie in the set.
    fn center(&self) -> Vec<f64> {
        self.hull()
            .map_or_else(|_| self.set.c().to_vec(), |hull| hull.mid().into_vec())
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        self.hull().ok()
    }
    fn contains(&self, x: &[Interval]) -> Containment {
        self.set.contains(x).unwrap_or(Containment::Undecided)
    }
    fn covariance(&self) -> Option<&Matrix> {
        None
    }
    fn size(&self) -> Size {
        Size {
            n_generators: Some(self.set.generators()),
            n_constraints: Some(self.set.constraints()),
            radius: radius(self.interval_hull().as_ref()),
            lp_count: self.work.programs as usize,
            pivots: self.work.pivots as usize,
            ..Size::default()
        }
    }
    /// By its vertices, up to three dimensions; rounded to nearest.
    fn volume(&self) -> Option<f64> {
        self.set.volume().ok().flatten()
    }
    /// Drawn from c, G, A and b; c is the center of the generators, not of the hull.
    fn shape(&self) -> Shape {
        Shape {
            kind: "constrained-zonotope",
            center: self.set.c().to_vec(),
            generators: Some(self.set.g().clone()),
            constraints: Some((self.set.a().clone(), self.set.b().to_vec())),
            ..Shape::default()
        }
    }
}
