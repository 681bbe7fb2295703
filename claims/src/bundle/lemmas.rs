//! Section IV: propagation and update by decomposition, with the corrected bounds of g.

use super::claim;
use super::decomposition::{Scalar, choices, remainder_bounds, supporting};
use crate::cz::{Intervals, eliminated, inclusion_of};
use crate::exact::{Cz, M, Q, Source, V, add, frac, q, sub, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "assumption-2",
            "(a reading of Assumption 2) Jacobian bounds over the set Z are enough for Lemma 2",
            "they have to hold on the whole box of the generators, as Proposition 4 asks",
            domain,
        ),
        claim(
            "lemma-1",
            "f(Z) is contained in (13), g bounded as corrected",
            "",
            bundle_propagation,
        ),
        claim(
            "lemma-2",
            "f(Z) is contained in (19), g bounded as corrected",
            "",
            propagation,
        ),
        claim(
            "theorem-1",
            "f(Z) is contained in the intersection of (13) and (19)",
            "",
            both_propagations,
        ),
        claim(
            "lemma-3",
            "the update of a ZB is contained in (24), g bounded as corrected",
            "the result is an intersection of CZs, not a ZB",
            bundle_update,
        ),
        claim(
            "lemma-4",
            "the update of a CZ is contained in (29), with c_f in b~, g bounded as corrected",
            "c_f has to read c_mu",
            update,
        ),
        claim(
            "theorem-2",
            "the update is contained in the intersection of (24) and (29)",
            "with c_mu in (29)",
            both_updates,
        ),
        claim(
            "lemma-5",
            "the update is contained in (35), G of (36) read as G_R",
            "",
            inclusion_update,
        ),
        claim(
            "proposition-5",
            "(5) holds with the Jacobian bounds of Proposition 4, and is not larger",
            "nested only if J is intersected with the natural bound: always intersect",
            refined_jacobian,
        ),
    ]
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

    /// H and the bounds of g = f(c + G ξ) − H ξ over |ξ| ≤ 1, a choice for each row.
    fn decomposed(&self, c: &[Q], g: &M, lower: &[Vec<bool>]) -> (M, V, V) {
        let n = g.cols();
        let (low, high) = (vec![q(-1); n], vec![q(1); n]);
        let mut h = Vec::new();
        let (mut below, mut above) = (Vec::new(), Vec::new());
        for (f, lower) in self.rows.iter().zip(lower) {
            let inner = f.over(c, g);
            let m = supporting(&inner.gradient(&low, &high), lower);
            let (a, b) = remainder_bounds(&inner, &m, lower, &low, &high);
            let constant = f.at(c);
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

/// (19) for one H, or (13) for one zonotope and one H.
fn propagated(f: &Map, z: &Cz, lower: &[Vec<bool>]) -> Cz {
    let (h, low, high) = f.decomposed(&z.c, &z.g, lower);
    let r = radius(&low, &high);
    Cz {
        g: h.beside(&M::diag(&r)),
        c: middle(&low, &high),
        a: z.a.beside(&M::zeros(z.a.rows(), r.len())),
        b: z.b.clone(),
    }
}

/// x² over {[1 0], 0, [1 −1], 1} = [0, 1]: there J is in [0, 2] and min(J, 0) = 0, so that g = ξ² is taken to rise from
/// g(−1) to g(1), both 1.
fn domain(t: &mut Trial) {
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
        (over(&[Q::zero()]), over(&low))
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

fn constrained(draw: &mut Source) -> Cz {
    let generators = draw.size(2, 3);
    draw.cz(2, generators, 1)
}

fn bundle_propagation(t: &mut Trial) {
    for _ in 0..60 {
        let f = Map::drawn(&mut t.draw);
        // A bundle of a zonotope and of a box about it: each member encloses the image of the bundle.
        let z = zonotope(&mut t.draw);
        let members = [z.clone(), Cz::boxed(z.c.clone(), &z.g.row_sums())];
        let points = z.points(&mut t.draw, 4);
        for member in &members {
            let lower = drawn_choice(&mut t.draw, member.g.cols());
            let set = propagated(&f, member, &lower);
            for x in &points {
                t.check(set.contains(&f.at(x)));
            }
        }
    }
}

fn propagation(t: &mut Trial) {
    for _ in 0..80 {
        let (f, z) = (Map::drawn(&mut t.draw), constrained(&mut t.draw));
        let lower = drawn_choice(&mut t.draw, z.g.cols());
        let set = propagated(&f, &z, &lower);
        for x in z.points(&mut t.draw, 4) {
            t.check(set.contains(&f.at(&x)));
        }
    }
}

fn both_propagations(t: &mut Trial) {
    for _ in 0..40 {
        let (f, z) = (Map::drawn(&mut t.draw), constrained(&mut t.draw));
        let free = z.relaxed();
        let points = z.points(&mut t.draw, 3);
        for lower in choices(z.g.cols()).into_iter().take(4) {
            let lower = vec![lower.clone(), lower];
            let sets = [propagated(&f, &z, &lower), propagated(&f, &free, &lower)];
            for x in &points {
                let y = f.at(x);
                t.check(sets.iter().all(|s| s.contains(&y)));
            }
        }
    }
}

/// (29) for one Ω; with c_f in b̃ as printed, or with c_μ. Without constraints it is (24) for one zonotope.
fn updated(mu: &Map, x: &Cz, y: &Cz, lower: &[Vec<bool>], printed: bool) -> Cz {
    let (omega, low, high) = mu.decomposed(&x.c, &x.g, lower);
    let r = radius(&low, &high);
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

/// μ, X, a point of X and a set Y that holds μ of it.
fn consistent(draw: &mut Source, constraints: usize) -> Option<(Map, Cz, V, Cz)> {
    let mu = Map::drawn(draw);
    let generators = draw.size(2, 3);
    let x = draw.cz(2, generators, constraints);
    let truth = x.points(draw, 3).pop()?;
    let mut y = draw.cz(2, 2 + constraints, constraints);
    let own = y.points(draw, 3).pop()?;
    y.c = add(&y.c, &sub(&mu.at(&truth), &own));
    Some((mu, x, truth, y))
}

fn bundle_update(t: &mut Trial) {
    for _ in 0..120 {
        let Some((mu, x, truth, y)) = consistent(&mut t.draw, 0) else {
            continue;
        };
        let lower = drawn_choice(&mut t.draw, x.g.cols());
        t.check(updated(&mu, &x, &y, &lower, false).contains(&truth));
    }
}

fn update(t: &mut Trial) {
    // X = [−1, 1], μ = x, Y = {1}, Ω = 1.
    let (x, y) = (Cz::boxed(v(&[0]), &[q(1)]), Cz::boxed(v(&[1]), &[q(0)]));
    let mu = Map {
        rows: vec![Scalar {
            q: M::zeros(1, 1),
            l: v(&[1]),
        }],
    };
    let printed = updated(&mu, &x, &y, &[vec![false]], true);
    t.check_or(printed.contains(&v(&[1])), || {
        format!(
            "X = [-1, 1], mu = x, Y = {{1}}: printed {{{}}}, truth {{1}}",
            printed
                .hull()
                .map_or("empty".to_owned(), |h| h[0].0.to_string())
        )
    });
    for _ in 0..150 {
        let Some((mu, x, truth, y)) = consistent(&mut t.draw, 1) else {
            continue;
        };
        let lower = drawn_choice(&mut t.draw, x.g.cols());
        t.check(updated(&mu, &x, &y, &lower, true).contains(&truth));
        t.repaired(updated(&mu, &x, &y, &lower, false).contains(&truth));
    }
}

fn both_updates(t: &mut Trial) {
    for _ in 0..80 {
        let Some((mu, x, truth, y)) = consistent(&mut t.draw, 1) else {
            continue;
        };
        let lower = drawn_choice(&mut t.draw, x.g.cols());
        let sets = [
            updated(&mu, &x, &y, &lower, false),
            updated(&mu, &x.relaxed(), &y.relaxed(), &lower, false),
        ];
        t.check(sets.iter().all(|s| s.contains(&truth)));
    }
}

/// The exact Jacobian bounds of a map over the hull of a set, as an interval matrix.
fn jacobian(mu: &Map, hull: &[(Q, Q)]) -> Intervals {
    let (low, high): (V, V) = hull.iter().cloned().unzip();
    let (mut mid, mut rad) = (Vec::new(), Vec::new());
    for f in &mu.rows {
        let (a, b) = f.gradient(&low, &high);
        mid.push(middle(&a, &b));
        rad.push(radius(&a, &b));
    }
    Intervals {
        mid: M::of_rows(2, &mid),
        rad: M::of_rows(2, &rad),
    }
}

fn inclusion_update(t: &mut Trial) {
    for _ in 0..120 {
        let Some((mu, x, truth, y)) = consistent(&mut t.draw, 1) else {
            continue;
        };
        let points = x.points(&mut t.draw, 1);
        let (Some(h), Some(hull)) = (points.first(), x.hull()) else {
            continue;
        };
        let j = jacobian(&mu, &hull);
        // (34): the inclusion of J_Δ (X − h), whose mid is 0.
        let moved = eliminated(&x.about(h));
        let delta = Intervals {
            mid: M::zeros(2, 2),
            rad: j.rad.clone(),
        };
        let spread = inclusion_of(&delta, &moved, &moved);
        let p: V = (0..2)
            .map(|i| spread.g[(i, spread.g.cols() - 2 + i)].clone())
            .collect();
        let link = j
            .mid
            .mul(&x.g)
            .beside(&y.g.scale(&q(-1)))
            .beside(&M::diag(&p));
        let right = add(&sub(&y.c, &mu.at(h)), &j.mid.apply(&sub(h, &x.c)));
        let set = Cz {
            g: x.g.beside(&M::zeros(2, y.g.cols() + 2)),
            c: x.c.clone(),
            a: x.a
                .block(&y.a)
                .beside(&M::zeros(x.a.rows() + y.a.rows(), 2))
                .above(&link),
            b: [x.b.clone(), y.b.clone(), right].concat(),
        };
        t.check(set.contains(&truth));
    }
}

/// J' ⊆ J with the same h and zonotope: mid(J')(X − h) ⊕ P' B within mid(J)(X − h) ⊕ P B. A bound of the Jacobian that is
/// not within J need not be.
fn refined_jacobian(t: &mut Trial) {
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
            mid: mid.add(&shift),
            rad: rad.sub(&loss),
        };
        let moved = x.about(&h);
        let outer = eliminated(&moved);
        let d = t.draw.direction(2, 3);
        let own = inclusion_of(&narrow, &moved, &outer).support(&d);
        let natural = inclusion_of(&wide, &moved, &outer).support(&d);
        t.check(own.zip(natural).is_some_and(|(a, b)| a <= b));
        // The enclosure itself, with the exact bounds of the Jacobian.
        let f = Map::drawn(&mut t.draw);
        let Some(hull) = x.hull() else { continue };
        let mut set = inclusion_of(&jacobian(&f, &hull), &moved, &outer);
        set.c = add(&set.c, &f.at(&h));
        let points = x.points(&mut t.draw, 2);
        t.check(points.iter().all(|x| set.contains(&f.at(x))));
    }
}
