//! What the set-membership filters of nonlinear systems share: the sets a problem gives, and beliefs that are sets.

use crate::error::finite_vector;
use crate::estimator::{Belief, Containment, Measurement, Shape, Size};
use crate::propagation::Dynamics;
use crate::{EstimationError, Problem, System, Uncertain};
use std::sync::OnceLock;
use zonobench_sets::lp::{LinearProgram, Work};
use zonobench_sets::{
    ConstrainedZonotope, Interval, IntervalVector, List, Matrix, SetError, Zonotope,
};

use super::measurement::{Reading, Sensor};

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

/// A system with the sets of its noises.
#[derive(Clone, Debug)]
pub(super) struct Model<Y> {
    pub system: Y,
    /// X_0.
    pub prior: ConstrainedZonotope,
    /// W.
    pub w: ConstrainedZonotope,
    sensor: Sensor,
    n_u: usize,
}

impl<Y: System> Model<Y> {
    /// Fails where the problem is not valid, a part has no set, or the system has parameters δ.
    pub fn new(kind: &'static str, problem: &Problem<Y>) -> Result<Self, EstimationError> {
        problem.validate()?;
        if problem.system.n_delta() > 0 {
            return Err(EstimationError::Unsupported {
                kind,
                what: problem.system.kind(),
                reason: "it knows no parameters δ".into(),
            });
        }
        Ok(Self {
            prior: set_of(kind, "prior", &problem.prior)?,
            w: set_of(kind, "noise.w", &problem.w)?,
            sensor: Sensor::new(kind, problem)?,
            n_u: problem.system.variables().u.len(),
            system: problem.system.clone(),
        })
    }

    /// f from step `k` to `k` + 1 under `u`. Fails where `u` is not an input.
    pub fn dynamics<'a>(
        &'a self,
        k: usize,
        u: &'a [f64],
    ) -> Result<Dynamics<'a, Y>, EstimationError> {
        finite_vector("input u", u, self.n_u)?;
        let (n, n_w) = (self.prior.dim(), self.w.dim());
        Ok(Dynamics::of_sizes(&self.system, k, u, n, n_w))
    }

    /// What y_k says of the x_k in the set of this hull; none where nothing was measured.
    pub fn read(
        &self,
        k: usize,
        u: &[f64],
        y: Measurement,
        hull: impl FnOnce() -> Result<IntervalVector, EstimationError>,
    ) -> Result<Option<Reading>, EstimationError> {
        self.sensor.read(&self.system, k, u, y, hull)
    }
}

/// A zonotope that contains x_k.
#[derive(Clone, Debug, PartialEq)]
pub struct ZonotopeBelief {
    pub(super) set: Zonotope,
    /// The measured components that were not read.
    pub(super) left_out: List<usize>,
}

impl ZonotopeBelief {
    /// The set.
    pub fn set(&self) -> &Zonotope {
        &self.set
    }
}

impl From<Zonotope> for ZonotopeBelief {
    fn from(set: Zonotope) -> Self {
        let left_out = List::new();
        Self { set, left_out }
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
    fn left_out(&self) -> &[usize] {
        &self.left_out
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
    /// The measured components that were not read.
    left_out: List<usize>,
}

impl ConstrainedBelief {
    pub(super) fn new(set: ConstrainedZonotope, work: Work) -> Self {
        Self {
            set,
            hull: OnceLock::new(),
            work,
            left_out: List::new(),
        }
    }

    /// With the hull known, because the next prediction needs it.
    pub(super) fn with_hull(
        set: ConstrainedZonotope,
        left_out: List<usize>,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        let hull = set.interval_hull_with(lp)?;
        Ok(Self {
            set,
            hull: OnceLock::from(Some(hull)),
            work: lp.work(),
            left_out,
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
            unfinished: self.work.unfinished as usize,
            fallbacks: self.work.fallbacks as usize,
            ..Size::default()
        }
    }
    /// By its vertices, up to three dimensions; rounded to nearest.
    fn volume(&self) -> Option<f64> {
        self.set.volume().ok().flatten()
    }
    fn left_out(&self) -> &[usize] {
        &self.left_out
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
