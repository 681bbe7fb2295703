//! A polytope that contains x_k, and the systems' functions that its filters decompose.

use crate::System;
use crate::estimator::{Belief, Containment, Shape, Size, box_contains};
use crate::propagation::generators::at_generators;
use std::sync::OnceLock;
use zonobench_sets::lp::{LinearProgram, Work};
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{
    ConstrainedZonotope, FacetBound, Interval, IntervalVector, Matrix, Polytope, SetError, Slab,
    Zonotope,
};

/// A polytope that contains x_k: a constrained zonotope with slack, its hull, and, made when first asked
/// for and up to three dimensions, its facets, vertices and volume.
#[derive(Clone, Debug)]
pub struct PolytopeBelief {
    pub(super) set: ConstrainedZonotope,
    pub(super) hull: IntervalVector,
    /// Slabs that hold the set and that no program was solved for: those of the last measurement.
    pub(super) strips: Vec<Slab>,
    /// Where all facets of the set are among known slabs: those.
    pub(super) half_spaces: Option<Vec<Slab>>,
    facets: FacetBound,
    outline: OnceLock<Result<Polytope, SetError>>,
    work: Work,
}

impl PolytopeBelief {
    /// With its hull by 2n linear programs. Fails with `Empty` if the set is proved empty.
    pub(super) fn new(
        set: ConstrainedZonotope,
        strips: Vec<Slab>,
        half_spaces: Option<Vec<Slab>>,
        facets: FacetBound,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        let hull = set.interval_hull_with(lp)?;
        Ok(Self {
            set,
            hull,
            strips,
            half_spaces,
            facets,
            outline: OnceLock::new(),
            work: lp.work(),
        })
    }

    /// The box of the hull, all else forgotten.
    pub(super) fn boxed(&self) -> Result<Self, SetError> {
        Ok(Self {
            set: ConstrainedZonotope::from_box(&self.hull)?,
            hull: self.hull.clone(),
            strips: Vec::new(),
            half_spaces: Some(Vec::new()),
            facets: self.facets,
            outline: OnceLock::from(Ok(Polytope::from_box(&self.hull))),
            work: self.work,
        })
    }

    /// A polytope whose facets are known.
    pub(super) fn known(
        polytope: Polytope,
        facets: FacetBound,
        lp: &LinearProgram,
    ) -> Result<Self, SetError> {
        Ok(Self {
            set: polytope.to_constrained_zonotope()?,
            hull: polytope.hull().clone(),
            strips: Vec::new(),
            half_spaces: Some(polytope.slabs().to_vec()),
            facets,
            outline: OnceLock::from(Ok(polytope)),
            work: lp.work(),
        })
    }

    /// The set.
    pub fn set(&self) -> &ConstrainedZonotope {
        &self.set
    }

    /// Facets, vertices and volume: of the set, or, where it has more facets than the filter keeps, of the
    /// polytope of those that cut most. Fails with `Range` above three dimensions.
    pub fn outline(&self) -> Result<&Polytope, SetError> {
        self.outline
            .get_or_init(|| {
                let known = self.half_spaces.clone();
                let known = known.map(|slabs| Polytope::new(self.hull.clone(), slabs));
                let (known, mut lp) = (known.transpose()?, LinearProgram::new());
                Polytope::enclosing_at_most(&self.set, known.as_ref(), self.facets, &mut lp)
            })
            .as_ref()
            .map_err(Clone::clone)
    }
}

impl Belief for PolytopeBelief {
    /// The center of the interval hull.
    fn center(&self) -> Vec<f64> {
        self.hull.mid().into_vec()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        Some(self.hull.clone())
    }
    /// Of [`PolytopeBelief::set`]. The hull and, up to three dimensions, the outline, which contain it, may show without a
    /// program that `x` is outside.
    fn contains(&self, x: &[Interval]) -> Containment {
        let outside = box_contains(&self.hull, x) == Containment::Outside
            || self
                .outline()
                .is_ok_and(|outline| outline.contains(x) == Containment::Outside);
        if outside {
            return Containment::Outside;
        }
        self.set.contains(x).unwrap_or(Containment::Undecided)
    }
    fn covariance(&self) -> Option<&Matrix> {
        None
    }
    fn size(&self) -> Size {
        Size {
            n_generators: Some(self.set.generators()),
            n_constraints: Some(self.set.constraints()),
            radius: Some(self.hull.rad().iter().copied().fold(0.0, f64::max)),
            lp_count: self.work.programs as usize,
            pivots: self.work.pivots as usize,
            unfinished: self.work.unfinished as usize,
            fallbacks: self.work.fallbacks as usize,
            ..Size::default()
        }
    }
    /// None in more than three dimensions.
    fn volume(&self) -> Option<f64> {
        self.outline().ok().and_then(Polytope::volume)
    }
    /// The set with its slack made generators, which is the same set.
    fn shape(&self) -> Shape {
        let small = match self.outline() {
            Ok(outline) => outline.to_constrained_zonotope().ok(),
            Err(_) => None,
        };
        let set = small.unwrap_or_else(|| self.set.clone()).fold();
        Shape {
            kind: "constrained-zonotope",
            center: set.c().to_vec(),
            generators: Some(set.g().clone()),
            constraints: Some((set.a().clone(), set.b().to_vec())),
            ..Shape::default()
        }
    }
}

/// Which of the system's two functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Dynamics,
    Output,
}

/// What stands for the noise e.
#[derive(Clone, Copy)]
pub(super) enum NoiseArgument<'a> {
    /// e = 0.
    Zero,
    /// e, behind x.
    Own,
    /// η with e = c + G η, behind x.
    Generators(&'a Zonotope),
}

/// x, (x, e) or (x, η) ↦ f(k, x, u, e) or h(k, x, u, e).
pub(super) struct Equation<'a, Y> {
    pub system: &'a Y,
    pub side: Side,
    pub k: usize,
    pub u: &'a [f64],
    pub n: usize,
    pub n_e: usize,
    pub outputs: usize,
    pub noise: NoiseArgument<'a>,
}

impl<Y: System> Equation<'_, Y> {
    fn apply<S: Real>(&self, x: &[S], e: &[S], out: &mut [S]) {
        match self.side {
            Side::Dynamics => self.system.f(self.k, x, self.u, e, out),
            Side::Output => self.system.h(self.k, x, self.u, e, out),
        }
    }
}

/// Noises of at most this many components need no allocation.
const SMALL: usize = 16;

impl<Y: System> Function for Equation<'_, Y> {
    fn inputs(&self) -> usize {
        match self.noise {
            NoiseArgument::Zero => self.n,
            NoiseArgument::Own => self.n + self.n_e,
            NoiseArgument::Generators(e) => self.n + e.generators(),
        }
    }
    fn outputs(&self) -> usize {
        self.outputs
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        let zero = S::constant(0.0);
        match self.noise {
            NoiseArgument::Own => self.apply(&z[..self.n], &z[self.n..], out),
            NoiseArgument::Generators(e) => {
                let e = at_generators(e, &z[self.n..]);
                self.apply(&z[..self.n], &e, out);
            }
            NoiseArgument::Zero if self.n_e <= SMALL => {
                self.apply(z, &[zero; SMALL][..self.n_e], out);
            }
            NoiseArgument::Zero => self.apply(z, &vec![zero; self.n_e], out),
        }
    }
}
