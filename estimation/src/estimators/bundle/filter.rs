//! The recursion that all these filters share.

use super::belief::{Equation, NoiseArgument, PolytopeBelief, Side};
use super::image::{Coordinates, beside, image, intersection, lift};
use super::{Carry, PolytopeFilterSettings, Start, facet_bound};
use crate::error::{before, finite_vector};
use crate::estimator::Measurement;
use crate::estimators::linear_output::check_measurement;
use crate::estimators::set_membership::set_of;
use crate::propagation::decomposition::{
    JacobianBounds, Recipe, Relation, Vectors, chosen_relations, combinations, jacobian_bounds,
    mean_value_relations,
};
use crate::propagation::product_up;
use crate::{EstimationError, Problem, System};
use zonobench_sets::interval_matrix::{jacobian_over, real_dot};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::units::picked;
use zonobench_sets::{
    ConstrainedZonotope, FacetBound, Frame, Interval, IntervalMatrix, IntervalVector, Matrix,
    Polytope, SetError, Slab,
};

/// One way to propagate a polytope.
#[derive(Clone, Debug)]
pub(super) enum Member {
    /// The mean value over the hull.
    MeanValue {
        jacobian: JacobianBounds,
        vectors: Vectors,
    },
    /// The decomposition over the hull, applied to the polytope.
    Hull(Recipe),
    /// The decomposition over every box of the bundle, applied to that box.
    Frames(Recipe),
}

/// How a filter uses its relations.
#[derive(Clone, Debug)]
pub(super) enum Method {
    /// The images by all members, intersected.
    Intersection(Vec<Member>),
    /// All relations for one state.
    Lift { recipe: Recipe },
}

#[derive(Clone, Debug)]
pub(super) struct PolytopeFilter<Y> {
    kind: &'static str,
    system: Y,
    prior: PolytopeBelief,
    w: ConstrainedZonotope,
    w_hull: IntervalVector,
    v: ConstrainedZonotope,
    v_hull: IntervalVector,
    n: usize,
    n_u: usize,
    n_y: usize,
    method: Method,
    start: Start,
    carry: Carry,
    facets: FacetBound,
}

impl<Y: System> PolytopeFilter<Y> {
    pub fn new(
        kind: &'static str,
        method: Method,
        settings: &PolytopeFilterSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        problem.validate()?;
        let variables = problem.system.variables();
        let n = variables.x.len();
        let unsupported =
            |what, reason: String| EstimationError::Unsupported { kind, what, reason };
        if problem.system.n_delta() > 0 {
            return Err(unsupported(
                problem.system.kind(),
                "it knows no parameters δ".into(),
            ));
        }
        let carry = match (settings.carry, n <= 3) {
            (Some(carry), _) => carry,
            (None, true) => Carry::Facets,
            (None, false) => Carry::Hull,
        };
        let needs_facets = carry == Carry::Facets || !matches!(method, Method::Lift { .. });
        if needs_facets && n > 3 {
            return Err(unsupported(
                "more than three states",
                format!(
                    "it needs the facets of its sets, and the system has {n} states; lift with carry = \"hull\" does not"
                ),
            ));
        }
        let facets = facet_bound(kind, settings, carry)?;
        let at = EstimationError::at(0, "assumed set");
        let set = |key, part| set_of(kind, key, part);
        let hull_of = |part: &crate::Uncertain, set: &ConstrainedZonotope| match part.constraints {
            None => Ok(part.box_hull()),
            Some(_) => set.interval_hull(),
        };
        let prior = set("prior", &problem.prior)?;
        let w = set("noise.w", &problem.w)?;
        let v = set("noise.v", &problem.v)?;
        Ok(Self {
            kind,
            w_hull: hull_of(&problem.w, &w).map_err(&at)?,
            v_hull: hull_of(&problem.v, &v).map_err(&at)?,
            prior: PolytopeBelief::new(prior, Vec::new(), None, facets, &mut LinearProgram::new())
                .map_err(&at)?,
            w,
            v,
            n,
            n_u: variables.u.len(),
            n_y: variables.y.len(),
            system: problem.system.clone(),
            method,
            start: settings.start,
            carry,
            facets,
        })
    }

    pub fn prior(&self) -> PolytopeBelief {
        self.prior.clone()
    }

    fn equation<'a>(
        &'a self,
        side: Side,
        k: usize,
        u: &'a [f64],
        noise: NoiseArgument<'a>,
    ) -> Equation<'a, Y> {
        let (n_e, outputs) = match side {
            Side::Dynamics => (self.w_hull.dim(), self.n),
            Side::Output => (self.v_hull.dim(), self.n_y),
        };
        Equation {
            system: &self.system,
            side,
            k,
            u,
            n: self.n,
            n_e,
            outputs,
            noise,
        }
    }

    /// How the noise enters, after a look at its derivative over the box of x.
    fn noise_over(
        &self,
        side: Side,
        k: usize,
        u: &[f64],
        over: &IntervalVector,
    ) -> Result<Noise, EstimationError> {
        let (set, hull, op) = match side {
            Side::Dynamics => (&self.w, &self.w_hull, "prediction"),
            Side::Output => (&self.v, &self.v_hull, "update"),
        };
        let at = EstimationError::at(k, op);
        self.check_domain(k, over)?;
        let from_zero: IntervalVector = hull.iter().map(|e| e.hull(&Interval::ZERO)).collect();
        let f = self.equation(side, k, u, NoiseArgument::Own);
        let (_, j) = jacobian_over(&f, &IntervalVector::stack(&[over, &from_zero])).map_err(&at)?;
        let d = j.select_columns(&(self.n..self.n + hull.dim()).collect::<Vec<_>>());
        if d.as_slice().iter().any(|e| e.rad() > CONSTANT * e.mag()) {
            if set.generators() == 0 {
                return Ok(Noise::General(None));
            }
            return Coordinates::of(set)
                .map(|c| Noise::General(Some(c)))
                .map_err(at);
        }
        let middle = d.mid();
        let mut range = IntervalMatrix::from(&middle).mul_vec(hull);
        let mut image = match powers(&middle) {
            Some(powers) => set.multiplied_by(&powers).map_err(&at)?,
            None => set.linear_map(&middle).map_err(&at)?,
        };
        if d.as_slice().iter().any(|e| !e.is_point()) {
            range = d.mul_vec(hull);
            let varies = product_up(&d.rad(), &hull.mag());
            image = image.widened_by(&varies).map_err(&at)?;
        }
        Ok(Noise::Added { image, range })
    }

    pub fn predict(
        &self,
        k: usize,
        belief: &PolytopeBelief,
        u: &[f64],
    ) -> Result<PolytopeBelief, EstimationError> {
        finite_vector("input u", u, self.n_u)?;
        let at = EstimationError::at(k, "prediction");
        let from = match self.carry {
            Carry::Facets => {
                let outline = belief.outline().map_err(&at)?;
                outline.thinned(self.facets.kept)
            }
            Carry::Hull => {
                Polytope::new(belief.hull.clone(), belief.strips.clone()).map_err(&at)?
            }
        };
        let (w, argument, noise) =
            match self.noise_over(Side::Dynamics, before(k)?, u, from.hull())? {
                Noise::Added { image, .. } => (image, NoiseArgument::Zero, None),
                Noise::General(noise) => (
                    ConstrainedZonotope::point(&vec![0.0; self.n]).map_err(&at)?,
                    NoiseArgument::Generators(self.w.zonotope()),
                    noise,
                ),
            };
        let mut lp = LinearProgram::new();
        let f = self.equation(Side::Dynamics, before(k)?, u, argument);
        let moved = match &self.method {
            Method::Lift { recipe } => lift(&f, &from, noise.as_ref(), *recipe, &w)
                .and_then(|set| PolytopeBelief::new(set, Vec::new(), None, self.facets, &mut lp)),
            Method::Intersection(members) => {
                let mut images = Vec::new();
                for member in members {
                    images.extend(self.images(k, member, &f, &from, noise.as_ref(), &mut lp)?);
                }
                intersection(images, &w, self.facets, &mut lp)
            }
        };
        moved.map_err(at)
    }

    /// Fails with `Refused` where the system is known not to be defined all over the box. The rotated boxes
    /// reach farther than the hull.
    fn check_domain(&self, k: usize, over: &IntervalVector) -> Result<(), EstimationError> {
        match self.system.domain_fault(over) {
            Some(reason) => Err(EstimationError::Refused {
                k,
                kind: self.kind,
                reason,
            }),
            None => Ok(()),
        }
    }

    /// The sets that { f(x) } lies in by `member`, whose intersection is the member's set.
    fn images(
        &self,
        k: usize,
        member: &Member,
        f: &Equation<Y>,
        from: &Polytope,
        noise: Option<&Coordinates>,
        lp: &mut LinearProgram,
    ) -> Result<Vec<ConstrainedZonotope>, EstimationError> {
        let at = EstimationError::at(k, "prediction");
        let whole = || {
            from.to_constrained_zonotope()
                .map(|x| Coordinates::beside(x, noise))
        };
        let over = beside(from.hull(), noise);
        let mut images = Vec::new();
        match member {
            Member::MeanValue { jacobian, vectors } => {
                let found = mean_value_over(f, &over, *jacobian, *vectors).map_err(&at)?;
                let set = whole().map_err(&at)?;
                images.push(image(&set, &found.iter().collect::<Vec<_>>()).map_err(&at)?);
            }
            Member::Hull(recipe) => {
                let rows = chosen(f, &Frame::identity(&over), *recipe).map_err(&at)?;
                let set = whole().map_err(&at)?;
                for choice in combinations(&rows).map_err(&at)? {
                    images.push(image(&set, &choice).map_err(&at)?);
                }
            }
            Member::Frames(recipe) => {
                for frame in from.frames(lp).map_err(&at)? {
                    self.check_domain(k, &frame.hull())?;
                    let set = ConstrainedZonotope::from_box(frame.range()).map_err(&at)?;
                    let set = Coordinates::beside(set, noise);
                    let rows = chosen(f, &framed(frame, noise), *recipe).map_err(&at)?;
                    for choice in combinations(&rows).map_err(&at)? {
                        images.push(image(&set, &choice).map_err(&at)?);
                    }
                }
            }
        }
        Ok(images)
    }

    pub fn update(
        &self,
        k: usize,
        belief: &PolytopeBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<PolytopeBelief, EstimationError> {
        finite_vector("input u", u, self.n_u)?;
        check_measurement(y, self.n_y)?;
        let at = EstimationError::at(k, "update");
        let mut updated = belief.clone();
        if y.iter().any(Option::is_some) {
            updated = self.corrected(k, belief, u, y)?;
        }
        if k == 0 && self.start == Start::Hull {
            updated = updated.boxed().map_err(&at)?;
        }
        Ok(updated)
    }

    /// The set cut by what was measured.
    ///
    /// Of every relation h_i(x, 0) − M x ∈ \[lo, hi\] the slab M x ∈ y_i − D v − \[lo, hi\] where D V is a box;
    /// else the slab M x + N η ∈ y_i − \[lo, hi\] of x and one η of V, projected: the rows share it.
    fn corrected(
        &self,
        k: usize,
        belief: &PolytopeBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<PolytopeBelief, EstimationError> {
        let at = EstimationError::at(k, "update");
        let noise = self.noise_over(Side::Output, k, u, &belief.hull)?;
        let (argument, coordinates) = match &noise {
            Noise::Added { .. } => (NoiseArgument::Zero, None),
            Noise::General(c) => (NoiseArgument::Generators(self.v.zonotope()), c.as_ref()),
        };
        let mu = self.equation(Side::Output, k, u, argument);
        let (mut strips, mut joint): (Vec<Slab>, Vec<Slab>) = (Vec::new(), Vec::new());
        for (i, relation) in self.output_relations(k, belief, &mu, coordinates)? {
            let Some(y) = y[i] else { continue };
            let y = Interval::point(y);
            let (of_x, of_noise) = relation.linear.split_at(self.n);
            let spread = match &noise {
                Noise::Added { range, .. } => range[i],
                Noise::General(Some(c)) => real_dot(Interval::ZERO, of_noise, c.range.as_slice()),
                Noise::General(None) => Interval::ZERO,
            };
            let slab = Slab {
                normal: of_x.to_vec(),
                range: y - spread - relation.remainder,
            };
            // A row that does not depend on x says nothing of it that a slab can hold.
            if slab.normal.iter().any(|m| *m != 0.0) && !strips.contains(&slab) {
                strips.push(slab);
            }
            let mut normal = relation.linear;
            if let Noise::Added { .. } = noise {
                normal.extend((0..self.n_y).map(|j| f64::from(i == j)));
            }
            joint.push(Slab {
                normal,
                range: y - relation.remainder,
            });
        }
        let beside = match &noise {
            Noise::Added { image, .. } if is_box(image) => None,
            Noise::Added { image, .. } => Some(image),
            Noise::General(c) => c.as_ref().map(|c| &c.set),
        };
        let set = match beside {
            None => belief.set.within(&strips),
            Some(noise) => {
                let both = belief.set.cartesian_product(noise).within(&joint);
                both.and_then(|both| both.components(0..self.n))
            }
        };
        let half_spaces = match (beside, &belief.half_spaces) {
            (None, Some(known)) => Some([&known[..], &strips].concat()),
            _ => None,
        };
        let mut lp = LinearProgram::new();
        set.and_then(|set| PolytopeBelief::new(set, strips, half_spaces, self.facets, &mut lp))
            .map_err(at)
    }

    /// All relations h_i − M (x, η) ∈ remainder, with their row i.
    fn output_relations(
        &self,
        k: usize,
        belief: &PolytopeBelief,
        mu: &Equation<Y>,
        noise: Option<&Coordinates>,
    ) -> Result<Vec<(usize, Relation)>, EstimationError> {
        let at = EstimationError::at(k, "update");
        let over = beside(&belief.hull, noise);
        let identity = Frame::identity(&over);
        let mut all: Vec<(usize, Relation)> = Vec::new();
        let mut take = |rows: Vec<Vec<Relation>>| {
            for (i, row) in rows.into_iter().enumerate() {
                all.extend(row.into_iter().map(|relation| (i, relation)));
            }
        };
        let each = |found: Vec<Relation>| found.into_iter().map(|r| vec![r]).collect();
        match &self.method {
            Method::Lift { recipe } => {
                let j =
                    jacobian_bounds(mu, &identity, recipe.jacobian, recipe.vectors).map_err(&at)?;
                take(chosen_relations(mu, &identity, &j, *recipe).map_err(&at)?);
                take(each(mean_value_relations(mu, &over, &j).map_err(&at)?));
            }
            Method::Intersection(members) => {
                let mut lp = LinearProgram::new();
                for member in members {
                    match member {
                        Member::MeanValue { jacobian, vectors } => {
                            let found = mean_value_over(mu, &over, *jacobian, *vectors);
                            take(each(found.map_err(&at)?));
                        }
                        Member::Hull(recipe) => take(chosen(mu, &identity, *recipe).map_err(&at)?),
                        Member::Frames(recipe) => {
                            let from = belief.outline().map_err(&at)?;
                            for frame in from.frames(&mut lp).map_err(&at)? {
                                self.check_domain(k, &frame.hull())?;
                                let frame = framed(frame, noise);
                                let mut rows = chosen(mu, &frame, *recipe).map_err(&at)?;
                                for relation in rows.iter_mut().flatten() {
                                    *relation = relation.in_state(&frame);
                                }
                                take(rows);
                            }
                        }
                    }
                }
            }
        }
        Ok(all)
    }
}

/// How a noise e enters over a box of x.
enum Noise {
    /// f(x, e) ∈ f(x, 0) + D e with a D that is constant but for rounding.
    Added {
        /// Contains D e for every e of the noise's set.
        image: ConstrainedZonotope,
        /// Its box.
        range: IntervalVector,
    },
    /// In any other way, by the coordinates of its set; a known noise has none.
    General(Option<Coordinates>),
}

/// A derivative whose radius is this small beside it is constant but for rounding.
const CONSTANT: f64 = 1e-12;

/// Whether the set is a box: no constraint, and every generator along an axis.
fn is_box(set: &ConstrainedZonotope) -> bool {
    let along_axis = |j: usize| set.g().col(j).iter().filter(|g| **g != 0.0).count() <= 1;
    set.constraints() == 0 && (0..set.generators()).all(along_axis)
}

/// The frame of (x, η).
fn framed(frame: Frame, noise: Option<&Coordinates>) -> Frame {
    match noise {
        Some(noise) => frame.beside(&noise.range),
        None => frame,
    }
}

fn mean_value_over<Y: System>(
    f: &Equation<Y>,
    over: &IntervalVector,
    jacobian: JacobianBounds,
    vectors: Vectors,
) -> Result<Vec<Relation>, SetError> {
    let j = jacobian_bounds(f, &Frame::identity(over), jacobian, vectors)?;
    mean_value_relations(f, over, &j)
}

/// The relations of every row that `recipe` chooses, over the box of `frame` and in its coordinates.
fn chosen<Y: System>(
    f: &Equation<Y>,
    frame: &Frame,
    recipe: Recipe,
) -> Result<Vec<Vec<Relation>>, SetError> {
    let j = jacobian_bounds(f, frame, recipe.jacobian, recipe.vectors)?;
    chosen_relations(f, frame, &j, recipe)
}

/// The diagonal of a diagonal matrix of positive powers of two: noise that is merely added, in a unit of its own.
fn powers(m: &Matrix) -> Option<Vec<f64>> {
    let entry = |i: usize| picked(m.row(i)).filter(|&(k, a)| k == i && a > 0.0);
    (m.rows() == m.cols())
        .then(|| (0..m.rows()).map(|i| entry(i).map(|(_, a)| a)).collect())
        .flatten()
}
