//! Section 4.3: the choice of h.

use super::claim;
use super::extensions::{Intervals, Quadratic, eliminated, inclusion_of};
use super::sets::weighted_closest;
use crate::exact::{Cz, M, Q, Source, V, dot, norm1, q, sub, text, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "corollary-1",
            "with h of (18) in X, (J, X - h) is contained in (J, X - h~) for any h~ in X",
            "not as an inclusion; the enclosure mu(h, W) + (J, X - h) is contained in that of h~ if mu(h, W) is exact",
            least_enclosure,
        ),
        claim(
            "lemma-1",
            "h solves (20), the least sum of the widths of m, iff it solves the linear program (21)",
            "",
            linear_program,
        ),
        claim(
            "lemma-1-optimal",
            "Lemma 1 yields an optimal choice of h: it reduces the conservatism of the inclusion",
            "the least sum of P_ii, not the least area: C2 can be beaten",
            least_area,
        ),
        claim(
            "remark-9",
            "if the h of Corollary 1 belongs to X, it coincides with the solution of Lemma 1",
            "only if no column of J is a point: the program needs a rule for ties",
            coincides,
        ),
    ]
}

fn absolute(x: &[Q]) -> V {
    x.iter().map(Signed::abs).collect()
}

fn drawn(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(0, 1);
    let generators = n + 1 + constraints;
    draw.cz(n, generators, constraints)
}

fn least_enclosure(t: &mut Trial) {
    let x = Cz::boxed(v(&[0]), &[q(1)]);
    let j = Intervals {
        mid: M::identity(1),
        rad: M::zeros(1, 1),
    };
    let own = inclusion_of(&j, &x, &x);
    let other = x.about(&v(&[1]));
    let moved = inclusion_of(&j, &other, &other);
    let hulls = own.hull().zip(moved.hull()).unwrap_or_default();
    t.check_or(hulls.0[0].1 <= hulls.1[0].1, || {
        format!(
            "X = [-1, 1], J = 1, h = 0, h~ = 1: [{}, {}] is not in [{}, {}]",
            hulls.0[0].0, hulls.0[0].1, hulls.1[0].0, hulls.1[0].1
        )
    });
    for _ in 0..120 {
        let n = t.draw.size(1, 2);
        let x = drawn(&mut t.draw, n);
        let h = eliminated(&x).c;
        if !x.contains(&h) {
            continue;
        }
        let f = Quadratic::drawn(&mut t.draw, n, 1);
        let Some(hull) = x.hull() else { continue };
        let j = f.gradient(&hull);
        let at = |h: &[Q]| {
            let moved = x.about(h);
            inclusion_of(&j, &moved, &eliminated(&moved))
        };
        let best = at(&h);
        for other in x.points(&mut t.draw, 2) {
            let second = at(&other);
            let d = t.draw.direction(n, 3);
            let supports = best.support(&d).zip(second.support(&d));
            t.check(supports.as_ref().is_some_and(|(a, b)| a <= b));
            let zero = [Q::zero()];
            t.repaired(supports.is_some_and(|(a, b)| {
                dot(&d, &f.at(&h, &zero)) + a <= dot(&d, &f.at(&other, &zero)) + b
            }));
        }
    }
}

/// Σᵢ rad Jᵢⱼ for each j.
fn weights(j: &Intervals) -> V {
    j.rad.t().row_sums()
}

fn linear_program(t: &mut Trial) {
    for _ in 0..60 {
        let n = t.draw.size(1, 2);
        let x = drawn(&mut t.draw, n);
        let j = Intervals {
            mid: M::zeros(n, n),
            rad: t.draw.matrix(n, n, 2).abs(),
        };
        let center = eliminated(&x).c;
        // The sum of the widths of m for h: twice Σᵢ (rad J |p̄|)ᵢ.
        let widths = |h: &[Q]| norm1(&j.rad.apply(&absolute(&sub(&center, h)))) * q(2);
        let Some((h, value)) = weighted_closest(&x, &center, &weights(&j)) else {
            t.check(false);
            continue;
        };
        t.check(x.contains(&h) && widths(&h) == q(2) * &value);
        for other in x.points(&mut t.draw, 5) {
            t.check(widths(&other) >= q(2) * &value);
        }
    }
}

/// The product of P_ii of (12): a quarter of the area of P B in the plane.
fn area(j: &Intervals, outer: &Cz, h: &[Q]) -> Q {
    let moved = outer.about(h);
    let own = j.rad.apply(&absolute(&moved.c));
    let spread = j.rad.mul(&moved.g.abs()).row_sums();
    (&own[0] + &spread[0]) * (&own[1] + &spread[1])
}

fn least_area(t: &mut Trial) {
    // X = {(t, 1 − t)}, a zonotope X̄ ⊇ X, J = [−1, 1] × diag(1, 2).
    let outer = Cz::boxed(v(&[0, 0]), &v(&[1, 10]));
    let j = Intervals {
        mid: M::zeros(2, 2),
        rad: M::ints(&[&[1, 0], &[0, 2]]),
    };
    let x = Cz {
        g: M::ints(&[&[1], &[-1]]).scale(&Q::new(1.into(), 2.into())),
        c: vec![Q::new(1.into(), 2.into()); 2],
        a: M::zeros(0, 1),
        b: Vec::new(),
    };
    if let Some((h, _)) = weighted_closest(&x, &outer.c, &weights(&j)) {
        let other = v(&[0, 1]);
        let (own, best) = (area(&j, &outer, &h), area(&j, &outer, &other));
        t.check_or(own <= best, || {
            format!(
                "mid J = 0, rad J = diag(1, 2), X = {{(t, 1 - t)}}, outer box [-1, 1] x [-10, 10]: the program \
                 gives h = {} with P11 P22 = {own}, h = {} gives {best}",
                text(&h),
                text(&other)
            )
        });
    }
    for k in 0..240 {
        // The zonotope of Remark 3, or any other that Theorem 1 admits: a box about X.
        let mut x = drawn(&mut t.draw, 2);
        let mut outer = eliminated(&x);
        if k % 2 == 0 {
            x = t.draw.cz(2, 1, 0);
            let wider = [q(t.draw.int(0, 10)), q(t.draw.int(0, 10))];
            let r = x.g.row_sums().into_iter().zip(wider);
            outer = Cz::boxed(x.c.clone(), &r.map(|(r, w)| r + w).collect::<V>());
            outer.c = t
                .draw
                .vector(2, 1)
                .iter()
                .zip(&outer.c)
                .map(|(d, c)| d + c)
                .collect();
            outer.g = outer.g.add(&M::identity(2));
        }
        let j = Intervals {
            mid: M::zeros(2, 2),
            rad: t.draw.matrix(2, 2, 3).abs(),
        };
        let Some((h, _)) = weighted_closest(&x, &outer.c, &weights(&j)) else {
            continue;
        };
        let own = area(&j, &outer, &h);
        let others = x.points(&mut t.draw, 6);
        t.check(others.iter().all(|other| area(&j, &outer, other) >= own));
    }
}

fn coincides(t: &mut Trial) {
    // The other solutions: points of X as close as h, which is at distance 0.
    let unique = |x: &Cz, h: &[Q], weight: &[Q], draw: &mut Source| {
        let points = x.points(draw, 6);
        let another = points
            .into_iter()
            .find(|p| p.as_slice() != h && dot(weight, &absolute(&sub(p, h))).is_zero());
        another.is_none()
    };
    let x = Cz::boxed(v(&[0]), &[q(1)]);
    let distance = dot(&v(&[0]), &absolute(&sub(&v(&[1]), &x.c)));
    t.check_or(!distance.is_zero(), || {
        "X = [-1, 1], J = 1 (a point): every h in X solves (21), not only h = 0".to_owned()
    });
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let x = drawn(&mut t.draw, n);
        let h = eliminated(&x).c;
        if !x.contains(&h) {
            continue;
        }
        let weight = t.draw.vector(n, 2);
        let weight = absolute(&weight);
        let one = unique(&x, &h, &weight, &mut t.draw);
        t.check(one);
        if weight.iter().all(|w| !w.is_zero()) {
            t.repaired(one);
        }
    }
}
