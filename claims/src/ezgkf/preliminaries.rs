//! Section II: Gaussian vectors, zonotopes, mixed vectors; and Remark 1.

use super::claim;
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, norm1, q, scale, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "equation-4",
            "the sum of uncorrelated Gaussian vectors is Gaussian",
            "the vectors have to be independent (or jointly Gaussian); uncorrelated is not enough",
            sum_of_gaussians,
        ),
        claim(
            "lemma-1",
            "zeta M is at most V |Lambda| V' for every zeta in [-1, 1]",
            "",
            absolute_matrix,
        ),
        claim(
            "abstract-zonotopes",
            "zonotopes are efficient representations of centrally symmetric convex polytopes",
            "only in the plane; from three dimensions some have no such representation",
            symmetric_polytopes,
        ),
        claim(
            "equations-8-11",
            "(8)-(10) are the image, the sum and the interval hull; (11) encloses an interval zonotope",
            "",
            operations,
        ),
        claim(
            "lemma-2",
            "(15) is the interval hull of the confidence ellipsoid of level 1 - alpha",
            "",
            ellipsoid_hull,
        ),
        claim(
            "lemma-2-level",
            "(a reading of I^alpha) the confidence box has the confidence level 1 - alpha",
            "its probability is at least 1 - alpha, and larger from two dimensions on",
            level,
        ),
        claim(
            "remark-1",
            "any nonlinearity with respect to x is placed in A",
            "only if f(0) = 0: a system with f(0) != 0 is refused unless the input or the noise carries f(0)",
            quasi_lpv,
        ),
    ]
}

/// A rational rotation of the plane.
pub fn rotation(draw: &mut Source) -> M {
    let triples = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (0, 1, 1), (1, 0, 1)];
    let (a, b, c) = triples[draw.size(0, triples.len() - 1)];
    let (cos, sin) = (draw.sign() * frac(a, c), draw.sign() * frac(b, c));
    M::of_rows(2, &[vec![cos.clone(), -sin.clone()], vec![sin, cos]])
}

/// V diag(d) Vᵀ and V diag(|d|) Vᵀ for a rational rotation V.
pub fn spectral(draw: &mut Source, d: &[Q]) -> (M, M) {
    let rotation = rotation(draw);
    let with = |d: &[Q]| rotation.mul(&M::diag(d)).mul(&rotation.t());
    (with(d), with(&d.iter().map(Signed::abs).collect::<V>()))
}

/// X ~ N(0, I) and W = S O X with a fair sign S and a rotation O: W ~ N(0, I) and E[X Wᵀ] = 0. Given S, d·(X + W)
/// is normal with the variance s± = |d ± Oᵀd|², so its fourth moment is 3 (s+² + s−²)/2; a normal number of the
/// same variance has 3 ((s+ + s−)/2)².
fn sum_of_gaussians(t: &mut Trial) {
    let moments = |d: &[Q], o: &M| {
        let image = o.t().apply(d);
        let square = |x: V| dot(&x, &x);
        let plus = square(add(d, &image));
        let minus = square(add(d, &scale(&q(-1), &image)));
        let mean = (&plus + &minus) / q(2);
        (
            (&plus * &plus + &minus * &minus) * frac(3, 2),
            q(3) * &mean * &mean,
        )
    };
    let (own, normal) = moments(&v(&[1]), &M::identity(1));
    t.check_or(own == normal, || {
        format!(
            "X ~ N(0, 1), W = S X with a fair sign S: X + W = 0 with probability 1/2, and E[(X + W)^4] = {own}, \
             a normal number of variance 2 has {normal}"
        )
    });
    for _ in 0..300 {
        let o = rotation(&mut t.draw);
        let d = t.draw.direction(2, 3);
        let (own, normal) = moments(&d, &o);
        t.check(own == normal);
        // Independent: E(x + w)⁴ = 3a² + 6ab + 3b².
        let (a, b) = (q(t.draw.int(0, 9)), q(t.draw.int(0, 9)));
        let own = q(3) * &a * &a + q(6) * &a * &b + q(3) * &b * &b;
        let sum = a + b;
        t.repaired(own == q(3) * &sum * &sum);
    }
}

fn absolute_matrix(t: &mut Trial) {
    for _ in 0..300 {
        let d = t.draw.vector(2, 4);
        let (m, bar) = spectral(&mut t.draw, &d);
        let zeta = t.draw.unit();
        t.check(bar.is_psd() && bar.sub(&m.scale(&zeta)).is_psd());
    }
}

/// Hlawka's inequality h(a) + h(b) + h(c) + h(a+b+c) ≥ h(a+b) + h(b+c) + h(a+c) holds for the support function of
/// every zonotope centred at 0.
fn hlawka(h: impl Fn(&[Q]) -> Q, a: &[Q], b: &[Q], c: &[Q]) -> bool {
    let ab = add(a, b);
    let left = h(a) + h(b) + h(c) + h(&add(&ab, c));
    left >= h(&ab) + h(&add(b, c)) + h(&add(a, c))
}

fn symmetric_polytopes(t: &mut Trial) {
    let support = |points: &[V], d: &[Q]| {
        let values = points.iter().map(|p| dot(p, d).abs());
        values.max().unwrap_or_else(Q::zero)
    };
    let octahedron = [v(&[1, 0, 0]), v(&[0, 1, 0]), v(&[0, 0, 1])];
    let [a, b, c] = [v(&[-1, 1, 1]), v(&[1, -1, 1]), v(&[1, 1, -1])];
    t.check_or(hlawka(|d| support(&octahedron, d), &a, &b, &c), || {
        "the octahedron conv(+-e1, +-e2, +-e3) breaks Hlawka's inequality of zonotopes at (-1,1,1), (1,-1,1), \
         (1,1,-1): 4 < 6"
            .to_owned()
    });
    for _ in 0..100 {
        for n in [3, 2] {
            let points: Vec<V> = (0..4).map(|_| t.draw.vector(n, 3)).collect();
            let zonotope = (0..20).all(|_| {
                let [a, b, c] = [(); 3].map(|()| t.draw.vector(n, 3));
                hlawka(|d| support(&points, d), &a, &b, &c)
            });
            if n == 3 {
                t.check(zonotope);
            } else {
                t.repaired(zonotope);
            }
        }
    }
}

fn operations(t: &mut Trial) {
    for _ in 0..100 {
        let n = t.draw.size(1, 2);
        let (x, w) = (t.draw.cz(n, n + 1, 0), t.draw.cz(n, n, 0));
        let l = t.draw.matrix(2, n, 2);
        let d = t.draw.direction(2, 3);
        t.check(x.image(&l).support(&d) == x.support(&l.t().apply(&d)));
        let d = t.draw.direction(n, 3);
        // The support of a zonotope is c·d + ‖Gᵀd‖₁.
        let own = |z: &Cz| dot(&z.c, &d) + norm1(&z.g.t().apply(&d));
        t.check(own(&x.sum(&w)) == own(&x) + own(&w));
        let r = x.g.row_sums();
        let hull = (0..n).map(|i| (&x.c[i] - &r[i], &x.c[i] + &r[i])).collect();
        t.check(x.hull() == Some(hull));
        let rad = t.draw.matrix(n, x.g.cols(), 1).abs();
        let wide = x.sum(&Cz::boxed(vec![Q::zero(); n], &rad.row_sums()));
        let member = M::from_fn(n, x.g.cols(), |i, j| {
            &x.g[(i, j)] + t.draw.unit() * &rad[(i, j)]
        });
        let point = add(&x.c, &member.apply(&t.draw.units(x.g.cols())));
        t.check(wide.contains(&point));
    }
}

/// The ellipsoid {x : xᵀ P⁻¹ x ≤ ς} reaches exactly √(ς P_ii) along axis i, at x = P eᵢ √(ς / P_ii).
fn ellipsoid_hull(t: &mut Trial) {
    for _ in 0..300 {
        let p = t.draw.definite(2);
        let Some(inverse) = p.inverse() else { continue };
        let x = t.draw.direction(2, 5);
        let level = dot(&x, &inverse.apply(&x));
        for i in 0..2 {
            t.check(&x[i] * &x[i] <= &level * &p[(i, i)]);
            let touch = p.col(i);
            let level = dot(&touch, &inverse.apply(&touch));
            t.check(&touch[i] * &touch[i] == level * &p[(i, i)]);
        }
    }
}

/// The box holds the ellipsoid; it has the same probability only if it holds nothing else.
fn level(t: &mut Trial) {
    let square = |x: &[Q], p: &M| p.inverse().map(|i| dot(x, &i.apply(x)));
    for n in [2, 1] {
        for k in 0..200 {
            let p = if k == 0 {
                M::identity(n)
            } else {
                t.draw.definite(n)
            };
            // A corner direction: x_i = ± s_i with s_i² just below ς P_ii, ς = 1.
            let signs: V = (0..n)
                .map(|_| if k == 0 { q(1) } else { t.draw.sign() })
                .collect();
            let corner: V = (0..n).map(|i| &signs[i] * below_root(&p[(i, i)])).collect();
            let outside = square(&corner, &p).is_some_and(|s| s > q(1));
            if n == 1 {
                t.repaired(!outside);
            } else {
                // A drawn point of the ellipsoid's surface is in the box.
                let x = t.draw.direction(n, 4);
                let reach = square(&x, &p);
                let inside = (0..n).all(|i| {
                    reach
                        .as_ref()
                        .is_some_and(|s| &x[i] * &x[i] <= s * &p[(i, i)])
                });
                t.equality(!outside, inside, || {
                    "P = I in the plane, sigma = 1: (99/100, 99/100) is in the box and not in the ellipse".to_owned()
                });
            }
        }
    }
}

/// A rational number a little below √x.
fn below_root(x: &Q) -> Q {
    let (mut low, mut high) = (Q::zero(), x + q(1));
    for _ in 0..10 {
        let middle = (&low + &high) / q(2);
        if &middle * &middle < *x {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// f(x) = A(x) x has f(0) = 0; a polynomial with f(0) = 0 is x times a polynomial.
fn quasi_lpv(t: &mut Trial) {
    t.check_or(vanishes_at_zero(&v(&[1])), || {
        "f(x) = 1: A(0) 0 = 0, f(0) = 1".to_owned()
    });
    for _ in 0..300 {
        let mut f = t.draw.vector(4, 3);
        t.check(vanishes_at_zero(&f));
        f[0] = Q::zero();
        let x = t.draw.unit();
        let at = |f: &[Q]| f.iter().rev().fold(Q::zero(), |s, f| s * &x + f);
        t.repaired(vanishes_at_zero(&f) && at(&f[1..]) * &x == at(&f));
    }
}

/// Whether the polynomial with these coefficients, lowest first, vanishes at 0.
fn vanishes_at_zero(f: &[Q]) -> bool {
    f[0].is_zero()
}
