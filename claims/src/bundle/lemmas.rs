//! Section IV: propagation and update by decomposition, with the corrected bounds of g.

use super::claim;
use super::decomposition::{Scalar, range_bounds, remainder_bounds, supporting};
use crate::cz::{Damage, Intervals, eliminated, inclusion_by, slope_in};
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, q, sub, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

/// The remainder [lower, upper] of g taken half as wide.
const HALVED: &str = "diag(upper - lower)/2 of the remainder halved";

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "assumption-2",
            "(ours) Jacobian bounds over the set Z alone are enough for Lemma 2",
            "they have to hold on the whole box of the generators, as Proposition 4 asks",
            |t| domain(t, false),
        )
        .class(Class::Remark)
        .twin("the Jacobian over half of the box", |t| domain(t, true)),
        claim(
            "lemma-1",
            "f(Z) is contained in (13) for every H, g bounded as corrected",
            "",
            |t| bundle_propagation(t, false),
        )
        .twin(HALVED, |t| bundle_propagation(t, true)),
        claim(
            "lemma-2",
            "f(Z) is contained in (19) for every H, g bounded as corrected between the ends below (21)",
            "",
            |t| propagation(t, Loss::None),
        )
        .twin(HALVED, |t| propagation(t, Loss::Half))
        .twin(
            "A^+ b left out of the ends of the coordinates that the constraints determine",
            |t| propagation(t, Loss::Ends),
        ),
        claim(
            "theorem-1",
            "f(Z) is contained in the intersection of (13) and (19)",
            "",
            |t| both_propagations(t, false),
        )
        .twin("the remainder of (19) halved", |t| {
            both_propagations(t, true);
        }),
        claim(
            "lemma-3",
            "the update of a ZB is contained in (24) for every Q, g bounded as corrected",
            "the result is an intersection of CZs, not a ZB",
            |t| bundle_update(t, false),
        )
        .twin(HALVED, |t| bundle_update(t, true)),
        claim(
            "lemma-4",
            "the update of a CZ is contained in (29), with c_f in b~, g bounded as corrected",
            "a slip: c_f has the dimension of the state; the proof, from (32) on, and Lemma 3 have c_mu",
            |t| update(t, Loss::None),
        )
        .class(Class::Slip)
        .twin(HALVED, |t| update(t, Loss::Half))
        .twin(
            "A_f^+ b_f left out of the ends of the coordinates that the constraints determine",
            |t| update(t, Loss::Ends),
        ),
        claim(
            "theorem-2",
            "the update is contained in the intersection of (24) and (29)",
            "with c_mu in (29)",
            |t| both_updates(t, false),
        )
        .twin("the remainder of (29) halved", |t| both_updates(t, true)),
        claim(
            "lemma-5",
            "the update is contained in (35), G of (36) read as G_R",
            "the half of (34) is to be taken once",
            |t| inclusion_update(t, Damage::None),
        )
        .twin("the half of (34) taken twice", |t| {
            inclusion_update(t, Damage::Half);
        })
        .twin("diam(m)/2 left out of (34)", |t| {
            inclusion_update(t, Damage::Center);
        }),
        claim(
            "proposition-5",
            "(5) holds with the bounds of the Jacobian by Proposition 4",
            "",
            |t| refined_jacobian(t, false),
        )
        .twin("the width of these bounds left out", |t| {
            refined_jacobian(t, true);
        }),
        claim(
            "proposition-5-nested",
            "(ours) within the natural bounds of the Jacobian those of Proposition 4 give a set within (5)",
            "always intersect: then D-RRSR lies in RRSR of the same set",
            |t| nested(t, false),
        )
        .class(Class::Remark)
        .twin("bounds that are not intersected with the natural ones", |t| {
            nested(t, true);
        }),
    ]
}

/// What a damaged twin loses.
#[derive(Clone, Copy, PartialEq)]
enum Loss {
    None,
    /// Half of the remainder's width.
    Half,
    /// A⁺ b of the coordinates' ends.
    Ends,
}

/// A function of two variables into the plane, and its composition with x = c + G ξ.
struct Map {
    rows: Vec<Scalar>,
}

impl Map {
    fn drawn(draw: &mut Source) -> Self {
        Self {
            rows: (0..2).map(|_| Scalar::drawn(draw, 2)).collect(),
        }
    }

    fn at(&self, x: &[Q]) -> V {
        self.rows.iter().map(|f| f.at(x)).collect()
    }

    /// H and the bounds of g = f(c + G ξ) − H ξ over a box of ξ, a choice for each row.
    fn decomposed(&self, z: &Cz, (low, high): &(V, V), lower: &[Vec<bool>]) -> (M, V, V) {
        let n = z.g.cols();
        let mut h = Vec::new();
        let (mut below, mut above) = (Vec::new(), Vec::new());
        for (f, lower) in self.rows.iter().zip(lower) {
            let inner = f.over(&z.c, &z.g);
            let m = supporting(&inner.gradient(low, high), lower);
            let (a, b) = remainder_bounds(&inner, &m, lower, low, high);
            let constant = f.at(&z.c);
            below.push(a + &constant);
            above.push(b + &constant);
            h.push(m);
        }
        (M::of_rows(n, &h), below, above)
    }
}

fn middle(low: &[Q], high: &[Q]) -> V {
    low.iter().zip(high).map(|(a, b)| (a + b) / q(2)).collect()
}

fn radius(low: &[Q], high: &[Q]) -> V {
    low.iter().zip(high).map(|(a, b)| (b - a) / q(2)).collect()
}

/// A choice of (6) for each of the two rows.
fn drawn_choice(draw: &mut Source, n: usize) -> Vec<Vec<bool>> {
    (0..2)
        .map(|_| (0..n).map(|_| draw.int(0, 1) == 1).collect())
        .collect()
}

/// ḻ and l̄ below (21): what A ξ = b leaves of [−1, 1] where it determines a coordinate.
fn ends(z: &Cz, loss: Loss) -> (V, V) {
    let n = z.g.cols();
    let (mut low, mut high) = (vec![q(-1); n], vec![q(1); n]);
    let at = z.a.t();
    let Some(inverse) = z.a.mul(&at).inverse() else {
        return (low, high);
    };
    let pseudo = at.mul(&inverse);
    let center = pseudo.apply(&z.b);
    let free = M::identity(n).sub(&pseudo.mul(&z.a));
    for i in 0..n {
        if free.row(i).iter().all(Zero::is_zero) {
            let value = if loss == Loss::Ends {
                Q::zero()
            } else {
                center[i].clone()
            };
            low[i] = value.clone().max(q(-1));
            high[i] = value.min(q(1));
        }
    }
    (low, high)
}

fn width_of(low: &[Q], high: &[Q], loss: Loss) -> V {
    let r = radius(low, high);
    if loss == Loss::Half {
        r.iter().map(|r| r / q(2)).collect()
    } else {
        r
    }
}

/// (19) for one H, or (13) for one zonotope and one H.
fn propagated(f: &Map, z: &Cz, lower: &[Vec<bool>], loss: Loss) -> Cz {
    let (h, low, high) = f.decomposed(z, &ends(z, loss), lower);
    let r = width_of(&low, &high, loss);
    Cz {
        g: h.beside(&M::diag(&r)),
        c: middle(&low, &high),
        a: z.a.beside(&M::zeros(z.a.rows(), r.len())),
        b: z.b.clone(),
    }
}

/// x² over {[1 0], 0, [1 −1], 1} = [0, 1]: there J is in [0, 2] and min(J, 0) = 0, so that g = ξ² is taken to rise from
/// g(−1) to g(1), both 1.
fn domain(t: &mut Trial, damaged: bool) {
    let trial = |scale: &Q| {
        let f = Scalar {
            q: M::diag(&[q(1)]),
            l: v(&[0]),
        };
        let (low, high) = ([-scale.clone()], [scale.clone()]);
        let over = |low: &[Q]| {
            let m = supporting(&f.gradient(low, &high), &[true]);
            let (a, b) = remainder_bounds(&f, &m, &[true], &[-scale.clone()], &high);
            // 0 = f(0) = m·0 + g(0).
            !a.is_positive() && !b.is_negative()
        };
        let whole = if damaged { [Q::zero()] } else { low };
        (over(&[Q::zero()]), over(&whole))
    };
    let (on_set, _) = trial(&q(1));
    t.check_or(on_set, || {
        "f = x^2 on {[1 0], 0, [1 -1], 1} = [0, 1]: J over the set is [0, 2], m = 0, g is bounded by [1, 1], f(0) = 0"
            .to_owned()
    });
    for _ in 0..100 {
        let (on_set, on_box) = trial(&frac(t.draw.int(1, 12), 4));
        t.check(on_set);
        t.repaired(on_box);
    }
}

fn zonotope(draw: &mut Source) -> Cz {
    let generators = draw.size(2, 3);
    draw.cz(2, generators, 0)
}

/// One constraint; in half of the draws it determines a coordinate, so that its row of I − A⁺ A is 0.
fn constrained(draw: &mut Source) -> Cz {
    let generators = draw.size(2, 3);
    let mut z = draw.cz(2, generators, 1);
    if draw.int(0, 1) == 0 {
        let (j, value, scale) = (draw.size(0, generators - 1), draw.unit(), draw.sign());
        z.a = M::from_fn(1, generators, |_, k| {
            if k == j { scale.clone() } else { Q::zero() }
        });
        z.b = vec![scale * value];
    }
    z
}

/// Two zonotopes that cross, neither of which holds the other as a rule, and their intersection as a CZ.
fn bundle(draw: &mut Source) -> ([Cz; 2], Cz) {
    let (first, mut second) = (zonotope(draw), zonotope(draw));
    let shared = [&first, &second].map(|z| {
        let xi = draw.units(z.g.cols());
        z.at(&xi)
    });
    second.c = add(&second.c, &sub(&shared[0], &shared[1]));
    let both = first.meet(&M::identity(2), &second);
    ([first, second], both)
}

fn bundle_propagation(t: &mut Trial, damaged: bool) {
    let loss = if damaged { Loss::Half } else { Loss::None };
    for _ in 0..60 {
        let f = Map::drawn(&mut t.draw);
        let (members, both) = bundle(&mut t.draw);
        let points = both.points(&mut t.draw, 4);
        for member in &members {
            let lower = drawn_choice(&mut t.draw, member.g.cols());
            let set = propagated(&f, member, &lower, loss);
            for x in &points {
                t.check(set.contains(&f.at(x)));
            }
        }
    }
}

fn propagation(t: &mut Trial, loss: Loss) {
    for _ in 0..80 {
        let (f, z) = (Map::drawn(&mut t.draw), constrained(&mut t.draw));
        let lower = drawn_choice(&mut t.draw, z.g.cols());
        let set = propagated(&f, &z, &lower, loss);
        for x in z.points(&mut t.draw, 4) {
            t.check(set.contains(&f.at(&x)));
        }
    }
}

/// Whether x is in the intersection, found as one set.
fn in_both(sets: &[Cz], x: &[Q]) -> bool {
    let whole = sets[1..]
        .iter()
        .fold(sets[0].clone(), |all, s| all.meet(&M::identity(2), s));
    whole.contains(x)
}

fn both_propagations(t: &mut Trial, damaged: bool) {
    let loss = if damaged { Loss::Half } else { Loss::None };
    for _ in 0..30 {
        let f = Map::drawn(&mut t.draw);
        let (members, both) = bundle(&mut t.draw);
        let mut sets: Vec<Cz> = Vec::new();
        for (z, loss) in [
            (&members[0], Loss::None),
            (&members[1], Loss::None),
            (&both, loss),
        ] {
            let lower = drawn_choice(&mut t.draw, z.g.cols());
            sets.push(propagated(&f, z, &lower, loss));
        }
        for x in both.points(&mut t.draw, 3) {
            t.check(in_both(&sets, &f.at(&x)));
        }
    }
}

/// (29) for one Ω; with c_f in b̃ as printed, or with c_μ. Without constraints it is (24) for one zonotope.
fn updated(mu: &Map, x: &Cz, y: &Cz, lower: &[Vec<bool>], printed: bool, loss: Loss) -> Cz {
    let (omega, low, high) = mu.decomposed(x, &ends(x, loss), lower);
    let r = width_of(&low, &high, loss);
    let link = omega.beside(&y.g.scale(&q(-1))).beside(&M::diag(&r));
    let center = if printed { &x.c } else { &y.c };
    Cz {
        g: x.g.beside(&M::zeros(x.g.rows(), y.g.cols() + r.len())),
        c: x.c.clone(),
        a: x.a
            .block(&y.a)
            .beside(&M::zeros(x.a.rows() + y.a.rows(), r.len()))
            .above(&link),
        b: [x.b.clone(), y.b.clone(), sub(center, &middle(&low, &high))].concat(),
    }
}

/// Sets of points moved so that they hold a point: a vertex of theirs, where a part that is missing shows.
fn moved_to(draw: &mut Source, sets: &mut [&mut Cz], own: &Cz, to: &[Q]) -> bool {
    let Some(vertex) = own.points(draw, 1).pop() else {
        return false;
    };
    let shift = sub(to, &vertex);
    for set in sets {
        set.c = add(&set.c, &shift);
    }
    true
}

/// μ, X, a point of X and a set Y that holds μ of it, all with as many constraints.
fn consistent(draw: &mut Source) -> Option<(Map, Cz, V, Cz)> {
    let mu = Map::drawn(draw);
    let x = constrained(draw);
    let truth = x.points(draw, 3).pop()?;
    let mut y = draw.cz(2, 3, 1);
    let own = y.clone();
    moved_to(draw, &mut [&mut y], &own, &mu.at(&truth)).then_some((mu, x, truth, y))
}

/// The same of bundles: X and Y are intersections of two zonotopes each.
struct Bundles {
    mu: Map,
    x: [Cz; 2],
    x_whole: Cz,
    y: [Cz; 2],
    y_whole: Cz,
    truth: V,
}

fn consistent_bundles(draw: &mut Source) -> Option<Bundles> {
    let mu = Map::drawn(draw);
    let (x, x_whole) = bundle(draw);
    let truth = x_whole.points(draw, 2).pop()?;
    let ([mut first, mut second], mut y_whole) = bundle(draw);
    let own = y_whole.clone();
    // The intersection moves with its members: its own constraint is about their difference alone.
    let to = mu.at(&truth);
    moved_to(
        draw,
        &mut [&mut first, &mut second, &mut y_whole],
        &own,
        &to,
    )
    .then_some(Bundles {
        mu,
        x,
        x_whole,
        y: [first, second],
        y_whole,
        truth,
    })
}

fn bundle_update(t: &mut Trial, damaged: bool) {
    let loss = if damaged { Loss::Half } else { Loss::None };
    for _ in 0..60 {
        let Some(c) = consistent_bundles(&mut t.draw) else {
            continue;
        };
        for x in &c.x {
            for y in &c.y {
                let lower = drawn_choice(&mut t.draw, x.g.cols());
                t.check(updated(&c.mu, x, y, &lower, false, loss).contains(&c.truth));
            }
        }
    }
}

fn update(t: &mut Trial, loss: Loss) {
    // X = [−1, 1], μ = x, Y = {1}, Ω = 1.
    let (x, y) = (Cz::boxed(v(&[0]), &[q(1)]), Cz::boxed(v(&[1]), &[q(0)]));
    let mu = Map {
        rows: vec![Scalar {
            q: M::zeros(1, 1),
            l: v(&[1]),
        }],
    };
    let printed = updated(&mu, &x, &y, &[vec![false]], true, Loss::None);
    t.check_or(printed.contains(&v(&[1])), || {
        format!(
            "X = [-1, 1], mu = x, Y = {{1}}: printed {{{}}}, truth {{1}}",
            printed
                .hull()
                .map_or("empty".to_owned(), |h| h[0].0.to_string())
        )
    });
    for _ in 0..150 {
        let Some((mu, x, truth, y)) = consistent(&mut t.draw) else {
            continue;
        };
        let lower = drawn_choice(&mut t.draw, x.g.cols());
        t.check(updated(&mu, &x, &y, &lower, true, loss).contains(&truth));
        t.repaired(updated(&mu, &x, &y, &lower, false, loss).contains(&truth));
    }
}

fn both_updates(t: &mut Trial, damaged: bool) {
    let loss = if damaged { Loss::Half } else { Loss::None };
    for _ in 0..40 {
        let Some(c) = consistent_bundles(&mut t.draw) else {
            continue;
        };
        let mut sets = Vec::new();
        for (x, y) in c.x.iter().zip(&c.y) {
            let lower = drawn_choice(&mut t.draw, x.g.cols());
            sets.push(updated(&c.mu, x, y, &lower, false, Loss::None));
        }
        let lower = drawn_choice(&mut t.draw, c.x_whole.g.cols());
        sets.push(updated(&c.mu, &c.x_whole, &c.y_whole, &lower, false, loss));
        t.check(in_both(&sets, &c.truth));
    }
}

/// An affine μ with a slope at a corner of J, where P has no slack, and μ over the hull of X.
fn inclusion_update(t: &mut Trial, damage: Damage) {
    for _ in 0..150 {
        let x = constrained(&mut t.draw);
        let points = x.points(&mut t.draw, 4);
        let (Some(h), Some(truth)) = (points.first(), points.last()) else {
            continue;
        };
        let j = Intervals::drawn(&mut t.draw, 2, 2);
        let slope = slope_in(&j, &sub(truth, h), &mut t.draw);
        let mu = |x: &[Q]| slope.apply(x);
        let mut y = t.draw.cz(2, 2, 0);
        let own = y.clone();
        if !moved_to(&mut t.draw, &mut [&mut y], &own, &mu(truth)) {
            continue;
        }
        // (34): the inclusion of J_Δ (X − h), whose mid is 0.
        let moved = eliminated(&x.about(h));
        let delta = Intervals {
            mid: M::zeros(2, 2),
            rad: j.rad.clone(),
        };
        let spread = inclusion_by(&delta, &moved, &moved, damage);
        let p: V = (0..2)
            .map(|i| spread.g[(i, spread.g.cols() - 2 + i)].clone())
            .collect();
        let link = j
            .mid
            .mul(&x.g)
            .beside(&y.g.scale(&q(-1)))
            .beside(&M::diag(&p));
        let right = add(&sub(&y.c, &mu(h)), &j.mid.apply(&sub(h, &x.c)));
        let set = Cz {
            g: x.g.beside(&M::zeros(2, y.g.cols() + 2)),
            c: x.c.clone(),
            a: x.a
                .block(&y.a)
                .beside(&M::zeros(x.a.rows() + y.a.rows(), 2))
                .above(&link),
            b: [x.b.clone(), y.b.clone(), right].concat(),
        };
        t.check(set.contains(truth));
    }
}

/// The cubic Σᵢ xᵢ (xᵀ Qᵢ x) + lᵀx of two variables, whose gradient is quadratic.
struct Cubic {
    q: [M; 2],
    l: V,
}

impl Cubic {
    fn drawn(draw: &mut Source) -> Self {
        Self {
            q: [draw.matrix(2, 2, 1), draw.matrix(2, 2, 1)],
            l: draw.vector(2, 2),
        }
    }

    fn at(&self, x: &[Q]) -> Q {
        let cube = |i: usize| &x[i] * dot(x, &self.q[i].apply(x));
        dot(&self.l, x) + cube(0) + cube(1)
    }

    /// ∂ⱼ without its constant lⱼ: xᵀ Qⱼ x + Σᵢ xᵢ ((Qᵢ + Qᵢᵀ) x)ⱼ.
    fn derivative(&self, j: usize) -> Scalar {
        let symmetric = |i: usize| self.q[i].add(&self.q[i].t());
        let crossed = M::from_fn(2, 2, |i, k| symmetric(i)[(j, k)].clone());
        Scalar {
            q: self.q[j].add(&crossed),
            l: vec![Q::zero(); 2],
        }
    }
}

/// Proposition 4 bounds every entry of the Jacobian over the hull, and (5) is taken with these bounds.
fn refined_jacobian(t: &mut Trial, damaged: bool) {
    for _ in 0..60 {
        let x = constrained(&mut t.draw);
        let Some(h) = x.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let Some(hull) = x.hull() else { continue };
        let (low, high): (V, V) = hull.into_iter().unzip();
        let f = [Cubic::drawn(&mut t.draw), Cubic::drawn(&mut t.draw)];
        let bounds = |i: usize, j: usize| {
            let (a, b) = range_bounds(&f[i].derivative(j), &low, &high);
            (a + &f[i].l[j], b + &f[i].l[j])
        };
        let jacobian = Intervals {
            mid: M::from_fn(2, 2, |i, j| {
                let (a, b) = bounds(i, j);
                (a + b) / q(2)
            }),
            rad: M::from_fn(2, 2, |i, j| {
                let (a, b) = bounds(i, j);
                if damaged { Q::zero() } else { (b - a) / q(2) }
            }),
        };
        let at = |x: &[Q]| -> V { f.iter().map(|f| f.at(x)).collect() };
        let moved = x.about(&h);
        let mut set = inclusion_by(&jacobian, &moved, &eliminated(&moved), Damage::None);
        set.c = add(&set.c, &at(&h));
        for x in x.points(&mut t.draw, 4) {
            t.check(set.contains(&at(&x)));
        }
    }
}

/// J' ⊆ J with the same h and zonotope: mid(J')(X − h) ⊕ P' B within mid(J)(X − h) ⊕ P B. A bound of the Jacobian that is
/// not within J need not be.
fn nested(t: &mut Trial, damaged: bool) {
    for _ in 0..120 {
        let x = constrained(&mut t.draw);
        let Some(h) = x.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let (mid, rad) = (t.draw.matrix(2, 2, 2), t.draw.matrix(2, 2, 2).abs());
        // Inside: the midpoint moves by at most what the radius loses.
        let part = M::from_fn(2, 2, |_, _| frac(t.draw.int(0, 4), 4));
        let loss = M::from_fn(2, 2, |i, j| &part[(i, j)] * &rad[(i, j)]);
        let shift = M::from_fn(2, 2, |i, j| t.draw.unit() * &loss[(i, j)]);
        let wide = Intervals {
            mid: mid.clone(),
            rad: rad.clone(),
        };
        let narrow = Intervals {
            mid: mid.add(&shift.scale(&q(if damaged { 3 } else { 1 }))),
            rad: rad.sub(&loss),
        };
        let moved = x.about(&h);
        let outer = eliminated(&moved);
        let d = t.draw.direction(2, 3);
        let own = inclusion_by(&narrow, &moved, &outer, Damage::None).support(&d);
        let natural = inclusion_by(&wide, &moved, &outer, Damage::None).support(&d);
        t.check(own.zip(natural).is_some_and(|(a, b)| a <= b));
    }
}
