//! Theorem 1, the criterion, and the complexity difference of Remark 4.

use super::claim;
use crate::exact::{M, Q, Source, frac, norm1, q};
use crate::{Claim, Trial};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-1",
            "the gain (29)-(32) minimises J^zg, and S is positive definite",
            "",
            optimal_gain,
        ),
        claim(
            "f-radius",
            "tr(G G') measures the size of the zonotope, so that the gain is optimal for the set",
            "optimal for this list of generators: parallel generators should be merged before the gain",
            criterion,
        ),
        claim(
            "remark-4",
            "for correlated noises the complexity difference of EZGKP and EZGKF does not change",
            "only if n_gv = n_gw or n = 1",
            complexity_difference,
        ),
    ]
}

/// J(K + D) − J(K) = tr(D S Dᵀ) at the optimal K.
fn optimal_gain(t: &mut Trial) {
    for _ in 0..200 {
        let (n, m) = (2, t.draw.size(1, 2));
        let g = t.draw.matrix(n, 3, 2);
        let gv = t.draw.matrix(m, m, 2);
        let (p, r) = (t.draw.definite(n), t.draw.definite(m));
        let c = t.draw.matrix(m, n, 2);
        let eta = frac(t.draw.int(1, 4), 4);
        let rest = q(1) - &eta;
        let mixed =
            |set: &M, covariance: &M| set.mul(&set.t()).scale(&rest).add(&covariance.scale(&eta));
        let (pz, rz) = (mixed(&g, &p), mixed(&gv, &r));
        let s = c.mul(&pz).mul(&c.t()).add(&rz);
        let Some(inverse) = s.inverse().filter(|_| s.is_psd()) else {
            t.check(false);
            continue;
        };
        let k = pz.mul(&c.t()).mul(&inverse);
        let cost = |k: &M| {
            let rest_of = M::identity(n).sub(&k.mul(&c));
            let set = rest_of.mul(&g).beside(&k.mul(&gv).scale(&q(-1)));
            let covariance = rest_of
                .mul(&p)
                .mul(&rest_of.t())
                .add(&k.mul(&r).mul(&k.t()));
            set.mul(&set.t()).trace() * &rest + covariance.trace() * &eta
        };
        let d = t.draw.matrix(n, m, 2).scale(&frac(1, 3));
        t.check(cost(&k.add(&d)) - cost(&k) == d.mul(&s).mul(&d.t()).trace());
    }
}

/// The radius of the scalar set after the gain that is optimal for this list of generators, C = G_v = 1.
fn radius_after(g: &[Q]) -> (Q, Q) {
    let p = g.iter().fold(q(0), |s, g| s + g * g);
    let k = &p / (&p + q(1));
    (p, (q(1) - &k) * norm1(g) + k)
}

/// The same set by two lists of generators: [a b] and [a + b] on a line.
fn criterion(t: &mut Trial) {
    let (split, merged) = (radius_after(&[q(1), q(1)]), radius_after(&[q(2)]));
    t.check_or(split == merged, || {
        format!(
            "{{[1 1]}} = {{[2]}}, but tr(G G') = {} and {}; with C = G_v = 1 the gains 2/3 and 4/5 give the radii {} and {}",
            split.0, merged.0, split.1, merged.1
        )
    });
    let positive = |draw: &mut Source| frac(draw.int(1, 12), 4);
    for _ in 0..300 {
        let g = [positive(&mut t.draw), positive(&mut t.draw)];
        let sum = &g[0] + &g[1];
        let (split, merged) = (radius_after(&g), radius_after(&[sum]));
        t.check(split.0 == merged.0);
    }
}

/// n m n_gv (1 − n_δ) + n² (n_gw − n_δ n_gv) − n n_gw: O(EZGKF) − O(EZGKP) as printed.
fn difference(n: i64, m: i64, delta: i64, gw: i64, gv: i64) -> i64 {
    n * m * gv * (1 - delta) + n * n * (gw - delta * gv) - n * gw
}

fn complexity_difference(t: &mut Trial) {
    let (before, after) = (difference(2, 1, 1, 1, 2), difference(2, 1, 1, 2, 2));
    t.check_or(before == after, || {
        format!("n = 2, m = n_delta = n_gw = 1, n_gv = 2: {before} becomes {after}")
    });
    for _ in 0..1000 {
        let [n, m, delta, gw, gv] = [(); 5].map(|()| t.draw.int(1, 6));
        let same = difference(n, m, delta, gw, gv) == difference(n, m, delta, gv, gv);
        t.check(same);
        if gv == gw || n == 1 {
            t.repaired(same);
        }
    }
}
