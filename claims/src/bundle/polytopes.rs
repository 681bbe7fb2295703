//! Section II: representations, and the results taken from \[Rego2020\].

use super::claim;
use crate::cz::{Damage, inclusion, mean_value};
use crate::exact::{Cz, M, Q, V, dot, norm1, q, scale, sub};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "definition-1",
            "a (bounded) polytope {z : A z <= b} can be exactly transformed into a CZ and into a ZB",
            "unbounded sets are refused",
            |t| representations(t, false),
        )
        .twin("the least value of a z over the box taken for 0", |t| {
            representations(t, true);
        }),
        claim(
            "proposition-1",
            "an interval vector is mid + diag(diam)/2 B, and an interval matrix is mid(J) + J_Delta",
            "",
            |t| intervals(t, false),
        )
        .twin("diam/4 in place of diam/2", |t| intervals(t, true)),
        claim("proposition-2", "J X is contained in (4)", "", |t| {
            inclusion(t, Damage::None);
        })
        .twin("diam(m)/2 left out of (3)", |t| {
            inclusion(t, Damage::Center);
        })
        .twin("P halved", |t| inclusion(t, Damage::Half)),
        claim(
            "proposition-3",
            "f(X, W) is contained in (5) for h in X",
            "",
            |t| mean_value(t, Damage::None),
        )
        .twin("diam(m)/2 left out of (3)", |t| {
            mean_value(t, Damage::Center);
        })
        .twin("P halved", |t| mean_value(t, Damage::Half)),
    ]
}

/// A box cut by half-spaces: one generator and one constraint each. For a·x ≤ b and the least value s of a·x over the
/// box, a·x + (b − s)/2 γ = (b + s)/2 with |γ| ≤ 1.
fn cut(r: &[Q], rows: &[(V, Q)], damaged: bool) -> Cz {
    let (n, m) = (r.len(), rows.len());
    let g = M::diag(r).beside(&M::zeros(n, m));
    let two = q(2);
    let mut a = Vec::new();
    let mut b = Vec::new();
    for (k, (normal, bound)) in rows.iter().enumerate() {
        let weighted: V = normal.iter().zip(r).map(|(a, r)| a * r).collect();
        let least = if damaged {
            Q::zero()
        } else {
            -norm1(&weighted)
        };
        let mut row = weighted;
        row.extend((0..m).map(|j| {
            if j == k {
                (bound - &least) / &two
            } else {
                Q::zero()
            }
        }));
        a.push(row);
        b.push((bound + &least) / &two);
    }
    Cz {
        g,
        c: vec![Q::zero(); n],
        a: M::of_rows(n + m, &a),
        b,
    }
}

/// The parallelogram with a·x in [low, high] and the perpendicular a' within the box: a zonotope of a bundle.
fn frame(a: &[Q], low: &Q, high: &Q, r: &[Q]) -> Cz {
    let across = vec![-a[1].clone(), a[0].clone()];
    let reach = &r[0] * across[0].abs() + &r[1] * across[1].abs();
    let square = dot(a, a);
    let first = scale(&((high - low) / (q(2) * &square)), a);
    let second = scale(&(reach / &square), &across);
    Cz::zonotope(
        M::from_fn(2, 2, |i, j| {
            if j == 0 {
                first[i].clone()
            } else {
                second[i].clone()
            }
        }),
        scale(&((high + low) / (q(2) * square)), a),
    )
}

fn representations(t: &mut Trial, damaged: bool) {
    for _ in 0..150 {
        let count = t.draw.size(2, 6);
        let normals: Vec<V> = (0..count).map(|_| t.draw.direction(2, 2)).collect();
        let r = [q(3), q(3)];
        let inner = t.draw.vector(2, 2);
        let rows: Vec<(V, Q)> = normals
            .into_iter()
            .map(|a| {
                let b = dot(&a, &inner) + q(t.draw.int(0, 2));
                (a, b)
            })
            .collect();
        let constrained = cut(&r, &rows, damaged);
        let mut bundle = vec![Cz::boxed(vec![q(0); 2], &r)];
        let zero = Q::zero();
        for (a, b) in &rows {
            let least = -norm1(&scale(&q(3), a));
            bundle.push(frame(a, if damaged { &zero } else { &least }, b, &r));
        }
        for _ in 0..4 {
            let x = t.draw.vector(2, 3);
            let inside = rows.iter().all(|(a, b)| dot(a, &x) <= *b);
            t.check(constrained.contains(&x) == inside);
            t.check(bundle.iter().all(|z| z.contains(&x)) == inside);
        }
    }
}

fn intervals(t: &mut Trial, damaged: bool) {
    let shrink = q(if damaged { 2 } else { 1 });
    for _ in 0..300 {
        let (c, r) = (t.draw.vector(2, 3), t.draw.vector(2, 3));
        let r: V = r.iter().map(Signed::abs).collect();
        let half: V = r.iter().map(|r| r / &shrink).collect();
        let set = Cz::boxed(c.clone(), &half);
        let x = t.draw.vector(2, 6);
        let inside = sub(&x, &c).iter().zip(&r).all(|(d, r)| d.abs() <= *r);
        t.check(set.contains(&x) == inside);
        // (2): every matrix of J is mid(J) and a matrix of J_Delta, and no other is.
        let (mid, rad) = (t.draw.matrix(2, 2, 2), t.draw.matrix(2, 2, 2).abs());
        let j = t.draw.matrix(2, 2, 4);
        let entries = || (0..2).flat_map(|i| (0..2).map(move |k| (i, k)));
        let (low, high) = (mid.sub(&rad), mid.add(&rad));
        let member = entries().all(|at| low[at] <= j[at] && j[at] <= high[at]);
        let rest = j.sub(&mid);
        t.check(member == entries().all(|at| rest[at].abs() <= &rad[at] / &shrink));
    }
}
