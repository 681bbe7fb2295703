//! The recursion that all these filters share.

use super::belief::{Equation, PolytopeBelief, Side};
use super::{Carry, PolytopeFilterSettings, Recipe, Start};
use crate::error::finite_vector;
use crate::estimator::Measurement;
use crate::estimators::linear_output::check_measurement;
use crate::estimators::set_membership::set_of;
use crate::propagation::decomposition::{
    Choose, JacobianBounds, Relation, Vectors, jacobian_bounds, linear_parts, mean_value_relations,
    narrowest, relations,
};
use crate::system::{AnySystem, System};
use crate::{EstimationError, Problem};
use zonobench_sets::interval_matrix::jacobian_over;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{
    ConstrainedZonotope, Frame, Interval, IntervalMatrix, IntervalVector, Matrix, Polytope,
    SetError, Slab, Zonotope,
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

/// At most this many images are intersected for one frame when all vectors of all rows are combined.
const MAX_IMAGES: usize = 1024;

#[derive(Clone, Debug)]
pub(super) struct PolytopeFilter {
    kind: &'static str,
    system: AnySystem,
    prior: PolytopeBelief,
    w: ConstrainedZonotope,
    w_hull: IntervalVector,
    v_hull: IntervalVector,
    n: usize,
    n_u: usize,
    n_y: usize,
    method: Method,
    start: Start,
    carry: Carry,
}

impl PolytopeFilter {
    pub fn new(
        kind: &'static str,
        method: Method,
        settings: &PolytopeFilterSettings,
        problem: &Problem,
    ) -> Result<Self, EstimationError> {
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
        let facets = carry == Carry::Facets || !matches!(method, Method::Lift { .. });
        if facets && n > 3 {
            return Err(unsupported(
                "more than three states",
                format!(
                    "it needs the facets of its sets, and the system has {n} states; lift with carry = \"hull\" does not"
                ),
            ));
        }
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
            prior: PolytopeBelief::new(prior, Vec::new(), &mut LinearProgram::new())
                .map_err(&at)?,
            w,
            n,
            n_u: variables.u.len(),
            n_y: variables.y.len(),
            system: problem.system.clone(),
            method,
            start: settings.start,
            carry,
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
        with_noise: bool,
    ) -> Equation<'a> {
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
            with_noise,
        }
    }

    /// The constant matrix D of e in f(x) + D e, after a look at the derivative over the box.
    fn noise_matrix(
        &self,
        side: Side,
        k: usize,
        u: &[f64],
        over: &IntervalVector,
    ) -> Result<Matrix, EstimationError> {
        let (noise, op) = match side {
            Side::Dynamics => (&self.w_hull, "prediction"),
            Side::Output => (&self.v_hull, "update"),
        };
        self.check_domain(k, over)?;
        let from_zero: IntervalVector = noise.iter().map(|e| e.hull(&Interval::ZERO)).collect();
        let f = self.equation(side, k, u, true);
        let (_, j) = jacobian_over(&f, &IntervalVector::stack(&[over, &from_zero]))
            .map_err(EstimationError::at(k, op))?;
        let d = j.select_columns(&(self.n..self.n + noise.dim()).collect::<Vec<_>>());
        if d.as_slice().iter().any(|e| !e.is_point()) {
            return Err(EstimationError::Unsupported {
                kind: self.kind,
                what: self.system.kind(),
                reason: "it needs noises that are added with constant factors".into(),
            });
        }
        Ok(d.mid())
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
            Carry::Facets => belief.outline().map_err(&at)?.clone(),
            Carry::Hull => {
                Polytope::new(belief.hull.clone(), belief.strips.clone()).map_err(&at)?
            }
        };
        let d = self.noise_matrix(Side::Dynamics, k - 1, u, from.hull())?;
        let w = if is_identity(&d) {
            self.w.clone()
        } else {
            self.w.linear_map(&d).map_err(&at)?
        };
        let mut lp = LinearProgram::new();
        let f = self.equation(Side::Dynamics, k - 1, u, false);
        let moved = match &self.method {
            Method::Lift { recipe } => lift(&f, &from, *recipe, &w)
                .and_then(|set| PolytopeBelief::new(set, Vec::new(), &mut lp)),
            Method::Intersection(members) => {
                let mut images = Vec::new();
                for member in members {
                    images.extend(self.images(k, member, &f, &from, &mut lp)?);
                }
                intersection(images, &w, &mut lp)
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

    /// The sets { f(x) } lies in by `member`, whose intersection is the member's set.
    fn images(
        &self,
        k: usize,
        member: &Member,
        f: &Equation,
        from: &Polytope,
        lp: &mut LinearProgram,
    ) -> Result<Vec<ConstrainedZonotope>, EstimationError> {
        let at = EstimationError::at(k, "prediction");
        let mut images = Vec::new();
        match member {
            Member::MeanValue { jacobian, vectors } => {
                let found = mean_value_over(f, from.hull(), *jacobian, *vectors).map_err(&at)?;
                let set = from.to_constrained_zonotope().map_err(&at)?;
                images.push(image(&set, &found.iter().collect::<Vec<_>>()).map_err(&at)?);
            }
            Member::Hull(recipe) => {
                let frame = Frame::identity(from.hull());
                let rows = chosen(f, &frame, *recipe).map_err(&at)?;
                let set = from.to_constrained_zonotope().map_err(&at)?;
                for choice in combinations(&rows).map_err(&at)? {
                    images.push(image(&set, &choice).map_err(&at)?);
                }
            }
            Member::Frames(recipe) => {
                for frame in from.frames(lp).map_err(&at)? {
                    self.check_domain(k, &frame.hull())?;
                    let rows = chosen(f, &frame, *recipe).map_err(&at)?;
                    let set = ConstrainedZonotope::from_box(frame.range()).map_err(&at)?;
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
            let strips = self.strips(k, belief, u, y)?;
            let set = belief.set.within(&strips).map_err(&at)?;
            updated = PolytopeBelief::new(set, strips, &mut LinearProgram::new()).map_err(&at)?;
        }
        if k == 0 && self.start == Start::Hull {
            updated = updated.boxed().map_err(&at)?;
        }
        Ok(updated)
    }

    /// The slabs M x ∈ y_i − D v − \[lo, hi\] of every relation h_i(x) − M x ∈ \[lo, hi\], for what was measured.
    fn strips(
        &self,
        k: usize,
        belief: &PolytopeBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<Vec<Slab>, EstimationError> {
        let at = EstimationError::at(k, "update");
        let hull = &belief.hull;
        let d = self.noise_matrix(Side::Output, k, u, hull)?;
        let noise = IntervalMatrix::from(&d).mul_vec(&self.v_hull);
        let mu = self.equation(Side::Output, k, u, false);
        let mut strips: Vec<Slab> = Vec::new();
        let mut take = |i: usize, relation: &Relation| {
            let Some(y) = y[i] else { return };
            let slab = Slab {
                normal: relation.linear.clone(),
                range: Interval::point(y) - noise[i] - relation.remainder,
            };
            // A row that does not depend on x says nothing of it that a slab can hold.
            if slab.normal.iter().any(|m| *m != 0.0) && !strips.contains(&slab) {
                strips.push(slab);
            }
        };
        let identity = Frame::identity(hull);
        match &self.method {
            Method::Lift { recipe } => {
                let j = jacobian_bounds(&mu, &identity, recipe.jacobian, recipe.vectors)
                    .map_err(&at)?;
                for (i, row) in rows_of(&mu, &identity, &j, *recipe)
                    .map_err(&at)?
                    .iter()
                    .enumerate()
                {
                    row.iter().for_each(|r| take(i, r));
                }
                let found = mean_value_relations(&mu, hull, &j).map_err(&at)?;
                found.iter().enumerate().for_each(|(i, r)| take(i, r));
            }
            Method::Intersection(members) => {
                let mut lp = LinearProgram::new();
                for member in members {
                    match member {
                        Member::MeanValue { jacobian, vectors } => {
                            let found =
                                mean_value_over(&mu, hull, *jacobian, *vectors).map_err(&at)?;
                            found.iter().enumerate().for_each(|(i, r)| take(i, r));
                        }
                        Member::Hull(recipe) => {
                            let rows = chosen(&mu, &identity, *recipe).map_err(&at)?;
                            for (i, row) in rows.iter().enumerate() {
                                row.iter().for_each(|r| take(i, r));
                            }
                        }
                        Member::Frames(recipe) => {
                            let from = belief.outline().map_err(&at)?;
                            for frame in from.frames(&mut lp).map_err(&at)? {
                                self.check_domain(k, &frame.hull())?;
                                let rows = chosen(&mu, &frame, *recipe).map_err(&at)?;
                                for (i, row) in rows.iter().enumerate() {
                                    row.iter().for_each(|r| take(i, &r.in_state(&frame)));
                                }
                            }
                        }
                    }
                }
            }
        }
        Ok(strips)
    }
}

fn mean_value_over(
    f: &Equation,
    over: &IntervalVector,
    jacobian: JacobianBounds,
    vectors: Vectors,
) -> Result<Vec<Relation>, SetError> {
    let j = jacobian_bounds(f, &Frame::identity(over), jacobian, vectors)?;
    mean_value_relations(f, over, &j)
}

/// The relations of every row that `recipe` chooses, over the box of `frame` and in its coordinates.
fn chosen(f: &Equation, frame: &Frame, recipe: Recipe) -> Result<Vec<Vec<Relation>>, SetError> {
    let j = jacobian_bounds(f, frame, recipe.jacobian, recipe.vectors)?;
    rows_of(f, frame, &j, recipe)
}

fn rows_of(
    f: &Equation,
    frame: &Frame,
    jacobian: &IntervalMatrix,
    recipe: Recipe,
) -> Result<Vec<Vec<Relation>>, SetError> {
    let rows = relations(f, frame, jacobian, recipe.vectors)?;
    Ok(match recipe.choose {
        Choose::All => rows,
        Choose::Argmin => rows.iter().map(|r| vec![narrowest(r).clone()]).collect(),
    })
}

/// One relation a row, in all combinations.
fn combinations(rows: &[Vec<Relation>]) -> Result<Vec<Vec<&Relation>>, SetError> {
    let count: usize = rows.iter().map(Vec::len).product();
    if count > MAX_IMAGES {
        return Err(SetError::Range {
            op: "combinations of all vectors of all rows",
            what: "their number",
            expected: "at most 1024 (choose = \"argmin\" has one)",
            got: count as f64,
        });
    }
    let mut all: Vec<Vec<&Relation>> = vec![Vec::new()];
    for row in rows {
        all = all
            .iter()
            .flat_map(|c| row.iter().map(move |r| [&c[..], &[r]].concat()))
            .collect();
    }
    Ok(all)
}

/// { M x + g : x ∈ X, g_i ∈ remainder_i }.
fn image(
    set: &ConstrainedZonotope,
    relations: &[&Relation],
) -> Result<ConstrainedZonotope, SetError> {
    let middle: Vec<f64> = relations.iter().map(|r| r.remainder.mid()).collect();
    let sides: Vec<f64> = relations.iter().map(|r| r.remainder.rad()).collect();
    set.affine_map(&linear_parts(relations), &middle)?
        .plus_box(&sides)
}

/// The intersection of the images, each enlarged by W.
fn intersection(
    images: Vec<ConstrainedZonotope>,
    w: &ConstrainedZonotope,
    lp: &mut LinearProgram,
) -> Result<PolytopeBelief, SetError> {
    let enlarged = images.into_iter().map(|image| image.minkowski_sum(w));
    let mut enlarged = enlarged.collect::<Result<Vec<_>, _>>()?;
    if enlarged.len() == 1 {
        let set = enlarged.remove(0);
        return PolytopeBelief::new(set, Vec::new(), lp);
    }
    let mut all: Option<Polytope> = None;
    for image in &enlarged {
        let facets = if image.constraints() == 0 {
            Polytope::of_zonotope(&without_flat_columns(image.zonotope())?)?
        } else {
            Polytope::enclosing_with(image, lp)?
        };
        all = Some(match all {
            Some(so_far) => so_far.intersect(&facets)?,
            None => facets,
        });
    }
    let all = all.expect("every member has an image");
    PolytopeBelief::known(all.simplified(lp)?, lp)
}

/// The zonotope with the boxes among its generators added up: columns along an axis become one.
fn without_flat_columns(z: &Zonotope) -> Result<Zonotope, SetError> {
    let n = z.dim();
    let mut sides = vec![Interval::ZERO; n];
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for j in 0..z.generators() {
        let column = z.g().col(j);
        let mut nonzero = (0..n).filter(|&i| column[i] != 0.0);
        match (nonzero.next(), nonzero.next()) {
            (None, _) => {}
            (Some(i), None) => sides[i] = sides[i] + Interval::point(column[i].abs()),
            _ => kept.push(column),
        }
    }
    let p = kept.len();
    let g = Matrix::from_fn(n, p + n, |i, j| {
        if j < p {
            kept[j][i]
        } else if j - p == i {
            sides[i].hi()
        } else {
            0.0
        }
    });
    Zonotope::with_rounding(z.c().to_vec(), g, z.r().to_vec())
}

/// { z + w : z_i − M x ∈ remainder for every relation of row i, for one x ∈ P; w ∈ W }.
fn lift(
    f: &Equation,
    from: &Polytope,
    recipe: Recipe,
    w: &ConstrainedZonotope,
) -> Result<ConstrainedZonotope, SetError> {
    let (n, hull) = (from.dim(), from.hull());
    let frame = Frame::identity(hull);
    let j = jacobian_bounds(f, &frame, recipe.jacobian, recipe.vectors)?;
    let mut rows = rows_of(f, &frame, &j, recipe)?;
    for (row, mean) in rows.iter_mut().zip(mean_value_relations(f, hull, &j)?) {
        if !row.contains(&mean) {
            row.push(mean);
        }
    }
    let mut slabs = Vec::new();
    let mut sides = Vec::with_capacity(2 * n);
    sides.extend(hull.iter().copied());
    for (i, row) in rows.iter().enumerate() {
        let mut side: Option<Interval> = None;
        for relation in row {
            let reach = relation
                .linear
                .iter()
                .zip(hull)
                .filter(|(m, _)| **m != 0.0)
                .fold(relation.remainder, |s, (&m, &x)| s + Interval::point(m) * x);
            side = Some(match side {
                // Both contain z_i, so they meet unless P is empty.
                Some(known) => known.intersect(&reach).unwrap_or(known),
                None => reach,
            });
            let mut normal: Vec<f64> = relation.linear.iter().map(|m| -m).collect();
            normal.extend((0..n).map(|l| f64::from(l == i)));
            slabs.push(Slab {
                normal,
                range: relation.remainder,
            });
        }
        sides.push(side.expect("every row has a relation"));
    }
    for slab in from.slabs() {
        let inclined = slab.normal.iter().filter(|a| **a != 0.0).count() > 1;
        if inclined {
            let mut normal = slab.normal.clone();
            normal.resize(2 * n, 0.0);
            slabs.push(Slab {
                normal,
                range: slab.range,
            });
        }
    }
    let both = ConstrainedZonotope::from_box(&IntervalVector::new(sides))?.within(&slabs)?;
    let g = Matrix::from_fn(n, 2 * n, |i, j| both.g()[(n + i, j)]);
    let z = Zonotope::new(both.c()[n..].to_vec(), g)?;
    ConstrainedZonotope::with_slack(
        z,
        both.a().clone(),
        both.b().to_vec(),
        both.delta().to_vec(),
    )?
    .minkowski_sum(w)
}

fn is_identity(m: &Matrix) -> bool {
    m.rows() == m.cols()
        && (0..m.rows()).all(|i| (0..m.cols()).all(|j| m[(i, j)] == f64::from(i == j)))
}
