//! Theorem 1, the criterion, and the complexities of Section IV-A and Remark 4.

use super::claim;
use crate::exact::{M, Q, Source, frac, norm1, q};
use crate::{Claim, Class, Trial};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-1",
            "the gain (29)-(32) minimises J^zg, and S is positive definite",
            "",
            |t| optimal_gain(t, &Gain::whole()),
        )
        .twin("a gain of nine tenths", |t| {
            optimal_gain(t, &Gain { part: frac(9, 10), ..Gain::whole() })
        })
        .twin("G^v for G^v (G^v)' in (31)", |t| {
            optimal_gain(t, &Gain { squared: false, ..Gain::whole() })
        }),
        claim(
            "f-radius",
            "(a remark of ours; the paper claims that K is optimal for J^zg) tr(G G') measures the size of the set",
            "it belongs to a list of generators: parallel generators can be merged before the gain, and the trace only grows",
            |t| criterion(t, q(1)),
        )
        .class(Class::Remark)
        .twin("merged, the trace is at least twice as large", |t| criterion(t, q(2))),
        claim(
            "section-IV-A-difference",
            "the difference of the two printed totals is n m n_gv (1 - n_delta) + n^2 (n_gw - n_delta n_gv) - n n_gw",
            "",
            |t| printed_difference(t, 1),
        )
        .twin("n n_gw left out", |t| printed_difference(t, 0)),
        claim(
            "remark-4",
            "for correlated noises, with n_gv in place of n_gw in both totals, the expression of the difference does not change",
            "",
            |t| correlated(t, true),
        )
        .twin("n_gw kept in O(EZGKP)", |t| correlated(t, false)),
        claim(
            "section-V-A-complexity",
            "there is no difference of complexity between EZGKP and EZGKF in Section V-A",
            "with the two columns that G^w is printed with, and one for v",
            |t| no_difference(t, 2),
        )
        .twin("G^w without its column of zeros", |t| no_difference(t, 1)),
    ]
}

/// (29) and (31), and what a damaged twin makes of them.
struct Gain {
    /// The part of the gain that is taken.
    part: Q,
    /// G^v (G^v)ᵀ in (31), not G^v.
    squared: bool,
}

impl Gain {
    fn whole() -> Self {
        Self {
            part: q(1),
            squared: true,
        }
    }
}

/// J(K + D) − J(K) = tr(D S Dᵀ) at the optimal K.
fn optimal_gain(t: &mut Trial, gain: &Gain) {
    for _ in 0..200 {
        let (n, m) = (2, t.draw.size(1, 2));
        let g = t.draw.matrix(n, 3, 2);
        // G^v (G^v)ᵀ ≻ 0 is a hypothesis; symmetric, so that the twin's (31) is.
        let gv = t.draw.definite(m);
        let (p, r) = (t.draw.definite(n), t.draw.definite(m));
        let c = t.draw.matrix(m, n, 2);
        let eta = frac(t.draw.int(0, 4), 4);
        let rest = q(1) - &eta;
        let mixed =
            |set: &M, covariance: &M| set.mul(&set.t()).scale(&rest).add(&covariance.scale(&eta));
        let (pz, rz) = (mixed(&g, &p), mixed(&gv, &r));
        let s = c.mul(&pz).mul(&c.t()).add(&rz);
        let used = if gain.squared {
            s.clone()
        } else {
            let rz = gv.scale(&rest).add(&r.scale(&eta));
            c.mul(&pz).mul(&c.t()).add(&rz)
        };
        let Some(inverse) = used.inverse().filter(|_| s.is_psd()) else {
            t.check(false);
            continue;
        };
        let k = pz.mul(&c.t()).mul(&inverse).scale(&gain.part);
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

/// The same set by two lists of generators: [a b] and [a + b] on a line. `least` is what the trace is multiplied by at
/// least when they are merged.
fn criterion(t: &mut Trial, least: Q) {
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
        t.repaired(merged.0 >= split.0 * &least);
    }
}

/// The sizes of a step; n_g log n_g is the same term in both totals, and stands here as one number.
#[derive(Clone, Copy)]
struct Sizes {
    n: i64,
    m: i64,
    p: i64,
    phi: i64,
    delta: i64,
    gw: i64,
    gv: i64,
    g: i64,
}

impl Sizes {
    fn drawn(draw: &mut Source) -> Self {
        let mut size = || draw.int(1, 6);
        let [n, m, p, delta, gw, gv] = [(); 6].map(|()| size());
        let [phi, g] = [(); 2].map(|()| n + size());
        Self {
            n,
            m,
            p,
            phi,
            delta,
            gw,
            gv,
            g,
        }
    }

    /// The total of Table I.
    fn filter(self) -> i64 {
        let Self {
            n,
            m,
            p,
            phi,
            delta,
            gw,
            gv,
            g,
        } = self;
        g + n * (g + p + m * gv)
            + n * n * (m + delta * phi + n * delta * delta + gw)
            + m * m * (n + m + gv)
    }

    /// O(EZGKP).
    fn predictor(self) -> i64 {
        let Self {
            n,
            m,
            p,
            phi,
            delta,
            gw,
            gv,
            g,
        } = self;
        g + n * (g + p + gw + m * delta * gv)
            + n * n * (m + delta * phi + n * delta * delta + delta * gv)
            + m * m * (n + m + gv)
    }

    /// O(EZGKF) − O(EZGKP) as printed, `last` times its last term.
    fn difference(self, last: i64) -> i64 {
        let Self {
            n,
            m,
            delta,
            gw,
            gv,
            ..
        } = self;
        n * m * gv * (1 - delta) + n * n * (gw - delta * gv) - last * n * gw
    }
}

fn printed_difference(t: &mut Trial, last: i64) {
    for _ in 0..1000 {
        let s = Sizes::drawn(&mut t.draw);
        t.check(s.filter() - s.predictor() == s.difference(last));
    }
}

/// Remark 4: n_gv at k − 1 and k in place of n_gw and n_gv in the filter, n_gw = n_gv in the predictor.
fn correlated(t: &mut Trial, both: bool) {
    for _ in 0..1000 {
        let s = Sizes::drawn(&mut t.draw);
        let same = Sizes { gw: s.gv, ..s };
        let predictor = if both { same } else { s };
        t.check(same.filter() - predictor.predictor() == same.difference(1));
    }
}

/// V-A has n = 2, m = n_δ = 1, a G^w of two columns, and one Gaussian number for v.
fn no_difference(t: &mut Trial, gw: i64) {
    for phi in [2, 100] {
        let s = Sizes {
            n: 2,
            m: 1,
            p: 0,
            phi,
            delta: 1,
            gw,
            gv: 1,
            g: phi,
        };
        t.check_or(s.filter() == s.predictor(), || {
            format!("{} against {}", s.filter(), s.predictor())
        });
    }
}
