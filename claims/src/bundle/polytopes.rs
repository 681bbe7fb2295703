//! Section II: representations, and the results taken from \[Rego2020\].

use super::claim;
use crate::cz::{inclusion, mean_value};
use crate::exact::{Cz, Lp, M, Q, V, dot, norm1, q, sub, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "definition-1",
            "a polytope {z : A z <= b} can be exactly transformed into a CZ or a ZB",
            "bounded polytopes only: unbounded sets are refused",
            representations,
        ),
        claim(
            "proposition-1",
            "an interval vector is mid + diag(diam)/2 B",
            "",
            intervals,
        ),
        claim("proposition-2", "J X is contained in (4)", "", inclusion),
        claim(
            "proposition-3",
            "f(X, W) is contained in (5) for h in X",
            "",
            mean_value,
        ),
    ]
}

/// A box cut by half-spaces: one generator and one constraint each. For a·x ≤ b and the least value s of a·x over the
/// box, a·x + (b − s)/2 γ = (b + s)/2 with |γ| ≤ 1.
fn cut(r: &[Q], rows: &[(V, Q)]) -> Cz {
    let (n, m) = (r.len(), rows.len());
    let g = M::diag(r).beside(&M::zeros(n, m));
    let two = q(2);
    let mut a = Vec::new();
    let mut b = Vec::new();
    for (k, (normal, bound)) in rows.iter().enumerate() {
        let weighted: V = normal.iter().zip(r).map(|(a, r)| a * r).collect();
        let least = -norm1(&weighted);
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

fn representations(t: &mut Trial) {
    // A direction in which the polytope has no end: A d ≤ 0, d ≠ 0.
    let bounded = |normals: &[V]| {
        let n = normals[0].len();
        let mut lp = Lp::unit(n);
        for a in normals {
            lp.row(a.clone(), -norm1(a), Q::zero());
        }
        let unit = M::identity(n);
        (0..n).all(|i| {
            let ends = [1, -1].map(|s| {
                let d: V = unit.row(i).iter().map(|x| x * q(s)).collect();
                lp.maximize(&d).is_some_and(|(value, _)| value.is_zero())
            });
            ends == [true, true]
        })
    };
    t.check_or(bounded(&[v(&[-1])]), || {
        "{z : -z <= 0} has no end; every CZ and every ZB is bounded".to_owned()
    });
    for _ in 0..150 {
        let count = t.draw.size(2, 6);
        let normals: Vec<V> = (0..count).map(|_| t.draw.direction(2, 2)).collect();
        t.check(bounded(&normals));
        // Within a box it is a CZ.
        let r = v(&[3, 3]);
        let inner = t.draw.vector(2, 2);
        let rows: Vec<(V, Q)> = normals
            .into_iter()
            .map(|a| {
                let b = dot(&a, &inner) + q(t.draw.int(0, 2));
                (a, b)
            })
            .collect();
        let set = cut(&r, &rows);
        for _ in 0..3 {
            let x = t.draw.vector(2, 3);
            let inside = rows.iter().all(|(a, b)| dot(a, &x) <= *b);
            t.repaired(set.contains(&x) == inside);
        }
    }
}

fn intervals(t: &mut Trial) {
    for _ in 0..300 {
        let (c, r) = (t.draw.vector(2, 3), t.draw.vector(2, 3));
        let r: V = r.iter().map(Signed::abs).collect();
        let set = Cz::boxed(c.clone(), &r);
        let x = t.draw.vector(2, 6);
        let inside = sub(&x, &c).iter().zip(&r).all(|(d, r)| d.abs() <= *r);
        t.check(set.contains(&x) == inside);
    }
}
