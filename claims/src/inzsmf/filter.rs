//! Section III: containment, stability, the gain.

use super::claim;
use super::group::{reduced, versine_over};
use crate::exact::{M, Q, frac, norm1, q};
use crate::{Claim, Class, Trial};
use num_traits::{One, Signed};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-3.1",
            "X_{k+1} is contained by the zonotope of (10)",
            "the paper says that the error \"approximately obeys\" the linear dynamic, and its proof is a chain of approximations, \
             which it is: as a statement of sets it needs the neglected remainder enclosed from the first step",
            |t| containment(t, true),
        )
        .twin("half of the bound on the remainder", |t| containment(t, false)),
        claim(
            "theorem-3.2",
            "with a constant A_k - L_k C_k = A, spectral radius below 1, and bounded noise the error dynamic is bounded",
            "with a varying speed no gain meets the hypothesis: C e1 = 0, so that (A_k - L_k C) e1 = (1, 0, delta nu_k)' for every L",
            constant_poles,
        )
        .twin("poles of each step alone, the speed varying", varying_poles),
        claim(
            "theorem-3.2-varying",
            "(a remark of ours, outside the hypothesis) constant poles do not replace a constant A - LC when the speed varies",
            "the poles have to be checked jointly",
            |t| poles(t, true),
        )
        .class(Class::Remark)
        .twin("the repair without a constant speed", |t| poles(t, false)),
        claim(
            "theorem-3.2-set",
            "(a remark of ours) with rho(A - LC) < 1 and bounded noise the reduced set need not stay bounded",
            "the reduction can outgrow the contraction: growth has to be detected, or s raised",
            |t| bounded_set(t, 10),
        )
        .class(Class::Remark)
        .twin("the repair with three generators", |t| bounded_set(t, 3)),
        claim(
            "theorem-3.3",
            "the gain (12) minimises the F-radius of H_{k+1} of (10d)",
            "with R_s(H) throughout; P_k is not used",
            |t| optimal_gain(t, q(1)),
        )
        .twin("a gain of nine tenths", |t| optimal_gain(t, frac(9, 10))),
        claim(
            "remark-6",
            "the alternative innovation yields the same estimate",
            "for the F gain; for poles only with L = L' R'",
            |t| same_estimate(t, true),
        )
        .twin("H_v not turned with the innovation", |t| same_estimate(t, false)),
        claim(
            "f-radius",
            "(a remark of ours; the paper claims that L is optimal for the F-radius) the F-radius measures the set",
            "it depends on the list of generators: parallel ones can be merged, and it only grows",
            |t| f_radius(t, q(1)),
        )
        .class(Class::Remark)
        .twin("merged, its square is at least twice as large", |t| f_radius(t, q(2))),
    ]
}

/// Three ways out of the set of (10) in one step, without any reduction. Returns whether the truth is in the set, by
/// bounds on sine and cosine that are rational.
enum Way {
    /// H = (σ, 0, 0)ᵀ, no gain, no noise, A = I − δ ad(u): along the vehicle the set is a point.
    Turn { s: Q, distance: Q, sigma: Q },
    /// No motion, no noise, H = diag(σ, 0, u), heading gain on the longitudinal innovation.
    Gain { sigma: Q, u: Q },
    /// No motion, no gain, H = (σ, 0, 0)ᵀ, noise (·, ±r, ±r): in h = σ/2 the lateral error is
    /// r (cos h + sin h) h / sin h ≥ r h (cot h + 1) ≥ r (1 − h²/2 + h), the set's is r.
    Noise { sigma: Q },
}

impl Way {
    /// How far beyond the set of (10) the truth is, at least.
    fn beyond(&self) -> Q {
        match self {
            Way::Turn { s, distance, sigma } => sigma * distance * versine_over(s),
            // The heading is σ + |u| (1 − cos σ)/σ, the set's half width σ.
            Way::Gain { sigma, u } => u.abs() * versine_over(sigma),
            Way::Noise { sigma } => {
                let h = sigma / q(2);
                &h - &h * &h / q(2)
            }
        }
    }
}

impl Way {
    /// A bound on what the linearisation drops there: (1 − cos σ)/σ ≤ σ/2, h cot h ≤ 1.
    fn remainder(&self) -> Q {
        match self {
            Way::Turn { s, distance, sigma } => sigma * distance * s / q(2),
            Way::Gain { sigma, u } => u.abs() * sigma / q(2),
            Way::Noise { sigma } => sigma / q(2),
        }
    }
}

fn containment(t: &mut Trial, whole: bool) {
    let (sigma, u) = (q(1), q(1));
    let gain = Way::Gain {
        sigma: sigma.clone(),
        u,
    };
    let reached = &sigma + gain.beyond();
    t.check_or(!gain.beyond().is_positive(), || {
        format!(
            "u = w = v = 0, L = [1 0; 0 0; 0 0], error (1, 0, 1): the heading error is 1 + (1 - cos 1) = 1.4597, at least \
             {reached}; the set ends at 1"
        )
    });
    let part = if whole { q(1) } else { frac(1, 2) };
    for k in 0..300 {
        let sigma = frac(t.draw.int(0, 10), 10);
        let way = match k % 3 {
            0 => Way::Turn {
                s: frac(t.draw.int(0, 10), 10),
                distance: q(t.draw.int(1, 5)),
                sigma,
            },
            1 => Way::Gain {
                sigma,
                u: t.draw.unit(),
            },
            _ => Way::Noise { sigma },
        };
        let beyond = way.beyond();
        t.check(!beyond.is_positive());
        // The set enlarged by the bound holds the truth, as far as the truth is known to go.
        t.repaired(beyond <= way.remainder() * &part);
    }
}

/// Heading and lateral error with the pole gain: [[1, −l1], [δν, 1 − l2]].
fn closed_loop(distance: &Q, p: &Q, r: &Q) -> M {
    let l2 = q(2) - p - r;
    let l1 = (p * r - q(1) + &l2) / distance;
    M::of_rows(2, &[vec![q(1), -l1], vec![distance.clone(), q(1) - l2]])
}

/// Whether both eigenvalues are inside the unit circle: |tr| < 1 + det and det < 1.
fn stable(m: &M) -> bool {
    let det = &m[(0, 0)] * &m[(1, 1)] - &m[(0, 1)] * &m[(1, 0)];
    m.trace().abs() < q(1) + &det && det < q(1)
}

/// Whether 128 steps of `m` are a contraction of the largest entry: then errors from bounded noise stay bounded.
fn contracts(m: &M) -> bool {
    let power = (0..7).fold(m.clone(), |m, _| m.mul(&m));
    power.row_sums().iter().all(|sum| *sum < q(1))
}

/// Poles below .9 in size, and two distances a step.
fn poles_and_distances(t: &mut Trial) -> [Q; 4] {
    let (a, b) = (q(t.draw.int(1, 9)), q(t.draw.int(1, 9)));
    let [p, r] = [(); 2].map(|()| frac(t.draw.int(-9, 9), 10));
    [a, b, p, r]
}

/// The hypothesis of the theorem: the same Ā at every step.
fn constant_poles(t: &mut Trial) {
    for _ in 0..100 {
        let [a, _, p, r] = poles_and_distances(t);
        let own = closed_loop(&a, &p, &r);
        t.check(stable(&own) && contracts(&own));
        // C e1 = 0: the first column of A − L C is that of A for every gain.
        let gain = t.draw.matrix(2, 1, 5);
        let c = M::ints(&[&[0, 1]]);
        let model = M::of_rows(2, &[vec![q(1), q(0)], vec![a.clone(), q(1)]]);
        t.check(model.sub(&gain.mul(&c)).col(0) == model.col(0));
    }
}

/// Without it: two distances in turn.
fn varying_poles(t: &mut Trial) {
    for _ in 0..100 {
        let [a, b, p, r] = poles_and_distances(t);
        t.check(contracts(
            &closed_loop(&a, &p, &r).mul(&closed_loop(&b, &p, &r)),
        ));
    }
}

fn poles(t: &mut Trial, constant: bool) {
    let product = |a: &Q, b: &Q, p: &Q, r: &Q| closed_loop(a, p, r).mul(&closed_loop(b, p, r));
    let example = product(&q(3), &q(1), &q(0), &q(0));
    t.check_or(stable(&example), || {
        format!(
            "omega = 0, delta nu alternating 1, 3, poles 0, 0: the product of two steps has the eigenvalue {}",
            example.trace()
        )
    });
    for _ in 0..500 {
        let [a, b, p, r] = poles_and_distances(t);
        t.check(stable(&product(&a, &b, &p, &r)));
        let next = if constant { &a } else { &b };
        t.repaired(stable(&closed_loop(&a, &p, &r)) && stable(&product(&a, next, &p, &r)));
    }
}

/// The half width of the hull after 8, 16 and 24 steps of H⁺ = [Ā R_s(H), I/100].
fn widths(a: &M, s: usize) -> [Q; 3] {
    let noise = M::identity(2).scale(&frac(1, 100));
    let mut h = M::identity(2);
    [(); 3].map(|()| {
        for _ in 0..8 {
            h = a.mul(&reduced(&h, s)).beside(&noise);
        }
        h.row_sums().into_iter().max().unwrap_or_else(Q::one)
    })
}

fn bounded_set(t: &mut Trial, many: usize) {
    let grows = |w: &[Q; 3]| w[2] > w[1] && w[1] > w[0] && &w[2] / &w[1] > frac(3, 2);
    let turns = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (20, 21, 29)];
    for (k, &(cos, sin, one)) in [9, 8, 7]
        .iter()
        .flat_map(|k| turns.iter().map(move |turn| (*k, turn)))
    {
        let turn = M::from_fn(2, 2, |i, j| match (i, j) {
            (0, 1) => frac(-sin, one),
            (1, 0) => frac(sin, one),
            _ => frac(cos, one),
        });
        let a = turn.scale(&frac(k, 10));
        let few = widths(&a, 3);
        t.check_or(!grows(&few), || {
            use num_traits::ToPrimitive;
            let at = |w: &Q| w.to_f64().unwrap_or(f64::INFINITY);
            format!(
                "A - LC = {}, W = I/100, H_0 = I, 3 generators: half width {:.2e}, {:.2e}, {:.2e} after 8, 16, 24 steps",
                a.text(),
                at(&few[0]),
                at(&few[1]),
                at(&few[2])
            )
        });
        t.repaired(!grows(&widths(&a, many)));
    }
}

fn optimal_gain(t: &mut Trial, part: Q) {
    for _ in 0..150 {
        let h = reduced(&t.draw.matrix(3, 8, 2), 6);
        let (a, c) = (t.draw.matrix(3, 3, 2), M::ints(&[&[0, 1, 0], &[0, 0, 1]]));
        let hv = M::identity(2).scale(&q(t.draw.int(1, 3)));
        let p = h.mul(&h.t());
        let s = c.mul(&p).mul(&c.t()).add(&hv.mul(&hv.t()));
        let Some(inverse) = s.inverse() else {
            t.check(false);
            continue;
        };
        let l = a.mul(&p).mul(&c.t()).mul(&inverse).scale(&part);
        let cost = |l: &M| {
            let next = a.sub(&l.mul(&c)).mul(&h).beside(&l.mul(&hv));
            next.mul(&next.t()).trace()
        };
        let d = t.draw.matrix(3, 2, 2).scale(&frac(1, 3));
        t.check(cost(&l.add(&d)) - cost(&l) == d.mul(&s).mul(&d.t()).trace());
    }
}

/// The innovation y − x̂ has C = R [0 I] and the noise H_v; the alternative R'(y − x̂) has [0 I] and R' H_v: L z is the
/// same if L = L' R'.
fn same_estimate(t: &mut Trial, turned: bool) {
    for _ in 0..150 {
        let h = t.draw.matrix(3, 5, 2);
        let p = h.mul(&h.t());
        let a = t.draw.matrix(3, 3, 2);
        let r = crate::ezgkf::rotation(&mut t.draw);
        let hv = t.draw.matrix(2, 2, 2).add(&M::identity(2).scale(&q(3)));
        let c = M::ints(&[&[0, 1, 0], &[0, 0, 1]]);
        let gain = |c: &M, hv: &M| {
            let s = c.mul(&p).mul(&c.t()).add(&hv.mul(&hv.t()));
            s.inverse().map(|s| a.mul(&p).mul(&c.t()).mul(&s))
        };
        let own = gain(&r.mul(&c), &hv);
        let other = gain(&c, &if turned { r.t().mul(&hv) } else { hv });
        if own.is_some() && other.is_some() {
            t.check(own == other.map(|l| l.mul(&r.t())));
        }
    }
}

fn f_radius(t: &mut Trial, least: Q) {
    let square = |g: &[Q]| g.iter().fold(q(0), |s, g| s + g * g);
    t.check_or(square(&[q(1), q(1)]) == square(&[q(2)]), || {
        "{[1 1]} = {[2]}, but the squared F-radius is 2 and 4".to_owned()
    });
    for _ in 0..200 {
        let g = [q(t.draw.int(1, 5)), q(t.draw.int(1, 5))];
        let merged = square(&[norm1(&g)]);
        t.check(square(&g) == merged);
        t.repaired(merged >= square(&g) * &least);
    }
}
