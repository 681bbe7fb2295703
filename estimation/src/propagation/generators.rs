//! Propagation and update in the space of the generators: sets { c + G ξ + e : A ξ = b, |e| ≤ r } and bundles of
//! zonotopes through any function, with noise and measurement sets of any shape.
//!
//! f̃(ξ) = f(c + G ξ) is decomposed over a box Ξ of ξ ([`decomposition`](super::decomposition)):
//! f̃_i(ξ) − H_i ξ ∈ \[g_i\]. The set may be one of (x, w), so noise need not be added. Where G = diag(r) is
//! the hull of a polytope and w is added, these are the closed forms of the polytopic filters, H = M diag(r).
//!
//! J holds on the box of { c + G ξ + e : ξ ∈ Ξ } and not merely on the set: with bounds over the hull of the set
//! the decomposition is false, because its corners are those of Ξ. Ξ is that of
//! [`coordinate_bounds`](scott::coordinate_bounds), which is contained in the paper's; that has \[−1, 1\]
//! wherever A does not determine ξ_j alone.
//!
//! Source: \[Khajenejad, Lemmas 1 to 5\], corrected: the bounds are those of g (see
//! [`decomposition`](super::decomposition)); the upper end of IΞ is A⁺b + κ r; the right side of Lemma 4 has c_μ
//! for c_f; in Lemma 5, G stands for G_R = \[0 P\], the copy of the prior's constraints, whose generators are
//! 0, is left out, and the ½ of Eq. (34) is taken once. The rounding boxes r are not in the paper.

use super::decomposition::{
    JacobianBounds, Recipe, Relation, Vectors, chosen_relations, combinations, jacobian_bounds,
    mean_value_relations,
};
use super::product_up;
use zonobench_sets::interval_matrix::real_dot;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::reduction::scott;
use zonobench_sets::{
    ConstrainedZonotope, Frame, Interval, IntervalVector, Matrix, SetError, Slab, Zonotope,
};

/// ξ ↦ f(c + G ξ).
struct OfGenerators<'a, F> {
    f: &'a F,
    z: &'a Zonotope,
}

impl<F: Function> Function for OfGenerators<'_, F> {
    fn inputs(&self) -> usize {
        self.z.generators()
    }
    fn outputs(&self) -> usize {
        self.f.outputs()
    }
    fn evaluate<S: Real>(&self, xi: &[S], out: &mut [S]) {
        self.f.evaluate(&at_generators(self.z, xi), out);
    }
}

/// c + G ξ.
pub(crate) fn at_generators<S: Real>(z: &Zonotope, xi: &[S]) -> Vec<S> {
    let component = |i: usize| {
        let terms = z.g().row(i).iter().zip(xi);
        terms
            .filter(|(g, _)| **g != 0.0)
            .fold(S::constant(z.c()[i]), |s, (&g, &xi)| s + xi * g)
    };
    (0..z.dim()).map(component).collect()
}

/// For every row i the chosen relations f_i(z) − H_i ξ ∈ \[lo, hi\] that hold for every z = c + G ξ + e of the set,
/// H_i of length p, the number of generators.
///
/// With J ∋ ∇f over the box of c + G Ξ + e, H comes from J G over Ξ, and |J_i| r is added to the ends. Fails with
/// `Empty` if the set is proved empty, `Domain` where f or a derivative may be undefined.
///
/// Source: \[Khajenejad, Cor. 1, Eqs. (9), (14), (15), (20), (21)\].
pub fn generator_relations<F: Function>(
    f: &F,
    set: &ConstrainedZonotope,
    recipe: Recipe,
) -> Result<Vec<Vec<Relation>>, SetError> {
    let xi = IntervalVector::new(scott::coordinate_bounds(set)?);
    let hull: IntervalVector = (0..set.dim())
        .map(|i| {
            let start = Interval::from_center_radius(set.c()[i], set.r()[i]);
            real_dot(start, set.g().row(i), xi.as_slice())
        })
        .collect();
    let j = jacobian_bounds(f, &Frame::identity(&hull), recipe.jacobian, recipe.vectors)?;
    let f = OfGenerators {
        f,
        z: set.zonotope(),
    };
    let frame = Frame::identity(&xi);
    let mut rows = chosen_relations(&f, &frame, &j.mul_matrix(set.g()), recipe)?;
    if set.r().iter().any(|&r| r > 0.0) {
        for (row, more) in rows.iter_mut().zip(&product_up(&j.mag(), set.r())) {
            for relation in row {
                relation.remainder = relation.remainder + Interval::from_center_radius(0.0, *more);
            }
        }
    }
    Ok(rows)
}

/// CZ_f: sets that all contain { f(z) : z ∈ Z }, one for every H: ⟨mid g, [H, diag(rad g)], [A, 0], b, δ⟩,
/// p + n generators and the constraints of Z.
///
/// Z may be that of (x, w). Fails as [`generator_relations`], and with `Range` for more than 1024 matrices.
///
/// Source: \[Khajenejad, Lemma 2, Eq. (19)\].
pub fn propagate<F: Function>(
    f: &F,
    z: &ConstrainedZonotope,
    recipe: Recipe,
) -> Result<Vec<ConstrainedZonotope>, SetError> {
    let rows = generator_relations(f, z, recipe)?;
    let (p, q) = (z.generators(), z.constraints());
    let image = |relations: &Vec<&Relation>| {
        let n = relations.len();
        let middle: Vec<f64> = relations.iter().map(|r| r.remainder.mid()).collect();
        let g = Matrix::from_fn(n, p + n, |i, j| match j.checked_sub(p) {
            None => relations[i].linear[j],
            Some(k) if k == i => relations[i].remainder.rad(),
            Some(_) => 0.0,
        });
        let a = Matrix::from_fn(q, p + n, |i, j| if j < p { z.a()[(i, j)] } else { 0.0 });
        ConstrainedZonotope::with_slack(
            Zonotope::new(middle, g)?,
            a,
            z.b().to_vec(),
            z.delta().to_vec(),
        )
    };
    combinations(&rows)?.iter().map(image).collect()
}

/// ZB_f: zonotopes that all contain { f(z) : z ∈ ∩ Z_s }, for every member of the bundle one for every H.
///
/// Fails as [`propagate`]. Source: \[Khajenejad, Lemma 1, Eq. (13)\].
pub fn propagate_bundle<F: Function>(
    f: &F,
    bundle: &[Zonotope],
    recipe: Recipe,
) -> Result<Vec<Zonotope>, SetError> {
    let mut images = Vec::new();
    for member in bundle {
        let sets = propagate(f, &member.clone().into(), recipe)?;
        images.extend(sets.iter().map(|set| set.zonotope().clone()));
    }
    Ok(images)
}

/// Encloses { x ∈ X : μ(x) ∈ Y } for X = ⟨c, G, A, b, r, δ⟩ and Y = ⟨d, K, B, b_y, r_y, δ_y⟩:
///
/// ⟨c, [G, 0], [A, 0; 0, B; Ω, −K], (b, b_y, mid (d − ν)), r, δ'⟩,
///
/// one row a relation μ_i(x) − Ω β ∈ ν, its half-width and r_y in δ', which
/// [`ConstrainedZonotope::fold`] makes the columns ½ diag(ν̄ − ν̲) of the paper. Of all vectors the rows share
/// one β and one γ: contained in the paper's intersection over Ω, without its copies of X.
///
/// Fails as [`generator_relations`], and with `Dimension`. The result may be empty.
///
/// Source: \[Khajenejad, Lemma 4, Eq. (29)\], with c_μ = d in the right side.
pub fn update<F: Function>(
    mu: &F,
    x: &ConstrainedZonotope,
    y: &ConstrainedZonotope,
    recipe: Recipe,
) -> Result<ConstrainedZonotope, SetError> {
    measured(mu, y)?;
    let rows = generator_relations(mu, x, recipe)?;
    let both = x.cartesian_product(y);
    let (p, q) = (x.generators(), both.constraints());
    let (mut b, mut delta) = (both.b().to_vec(), both.delta().to_vec());
    let mut added: Vec<(usize, &Relation)> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        for relation in row {
            let range = Interval::from_center_radius(y.c()[i], y.r()[i]) - relation.remainder;
            b.push(range.mid());
            delta.push(range.rad());
            added.push((i, relation));
        }
    }
    let a = Matrix::from_fn(q + added.len(), both.generators(), |i, j| {
        let Some(k) = i.checked_sub(q) else {
            return both.a()[(i, j)];
        };
        let (of, relation) = added[k];
        if j < p {
            relation.linear[j]
        } else {
            -y.g()[(of, j - p)]
        }
    });
    let z = both.components(0..x.dim())?.zonotope().clone();
    ConstrainedZonotope::with_slack(z, a, b, delta)
}

/// ZB_u: constrained zonotopes that all contain { x ∈ ∩ X_r : μ(x) ∈ ∩ Y_t }, one for every r and t.
///
/// Fails as [`update`]. Source: \[Khajenejad, Lemma 3, Eq. (24)\].
pub fn update_bundle<F: Function>(
    mu: &F,
    xs: &[Zonotope],
    ys: &[Zonotope],
    recipe: Recipe,
) -> Result<Vec<ConstrainedZonotope>, SetError> {
    let mut sets = Vec::with_capacity(xs.len() * ys.len());
    for x in xs {
        for y in ys {
            sets.push(update(mu, &x.clone().into(), &y.clone().into(), recipe)?);
        }
    }
    Ok(sets)
}

/// Encloses { x ∈ X : μ(x) ∈ Y } by the mean value over the hull of X, h its middle:
///
/// ⟨c, [G, 0], [A, 0; 0, B; mid J G, −K], (b, b_y, d − μ(h) + mid J (h − c)), r, δ'⟩,
///
/// δ'_i = ½ Σ_k diam J_ik r_k of the hull's half-widths r, r_y and the rounding; h need not lie in X, because
/// the hull holds both. 2n linear programs for the hull.
///
/// Fails with `Dimension`, `Domain`, or `Empty` if X is proved empty. The result may be empty.
///
/// Source: \[Khajenejad, Lemma 5, Eq. (35)\]; with `JacobianBounds::Decomposition` the J of Prop. 5.
pub fn update_by_mean_value<F: Function>(
    mu: &F,
    x: &ConstrainedZonotope,
    y: &ConstrainedZonotope,
    jacobian: JacobianBounds,
    vectors: Vectors,
    lp: &mut LinearProgram,
) -> Result<ConstrainedZonotope, SetError> {
    measured(mu, y)?;
    let hull = x.interval_hull_with(lp)?;
    let j = jacobian_bounds(mu, &Frame::identity(&hull), jacobian, vectors)?;
    let relations = mean_value_relations(mu, &hull, &j)?;
    let slabs: Vec<Slab> = relations
        .iter()
        .enumerate()
        .map(|(i, relation)| {
            // μ_i(x) is y_i: M x − y_i ∈ −remainder.
            let mut normal = relation.linear.clone();
            normal.extend((0..y.dim()).map(|j| if i == j { -1.0 } else { 0.0 }));
            Slab {
                normal,
                range: -relation.remainder,
            }
        })
        .collect();
    x.cartesian_product(y)
        .within(&slabs)?
        .components(0..x.dim())
}

/// Fails with `Dimension` unless Y has a component for every row of μ.
fn measured<F: Function>(mu: &F, y: &ConstrainedZonotope) -> Result<(), SetError> {
    if mu.outputs() == y.dim() {
        return Ok(());
    }
    Err(SetError::Dimension {
        op: "update with a measurement set",
        expected: mu.outputs(),
        got: y.dim(),
    })
}
