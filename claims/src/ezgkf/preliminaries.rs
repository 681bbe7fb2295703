//! Section II: Gaussian vectors, zonotopes, mixed vectors; and Remark 1.

use super::claim;
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, norm1, q, scale, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "equation-4",
            "the sum of uncorrelated Gaussian vectors is Gaussian",
            "the vectors have to be independent, or jointly Gaussian, which is the usual idiom; it matters in the quasi-LPV case \
             only, where A(delta) g depends on g by delta too",
            |t| sum_of_gaussians(t, 6),
        )
        .twin("a third of the cross term 6 a b of the independent sum left out", |t| sum_of_gaussians(t, 4)),
        claim(
            "lemma-1",
            "V |Lambda| V' is positive semidefinite, and zeta M is at most V |Lambda| V' for every zeta in [-1, 1]",
            "",
            |t| absolute_matrix(t, false),
        )
        .twin("absolute values entry by entry", |t| absolute_matrix(t, true)),
        claim(
            "equations-8-11",
            "(8)-(10) are the image, the sum and the interval hull; (11) encloses an interval zonotope",
            "",
            |t| operations(t, &Operations::whole()),
        )
        .twin("signs kept in (10)", |t| {
            operations(t, &Operations { absolute: false, ..Operations::whole() })
        })
        .twin("nine tenths of L in (11)", |t| {
            operations(t, &Operations { l: frac(9, 10), ..Operations::whole() })
        }),
        claim(
            "lemma-2",
            "(15) is the interval hull of the confidence ellipsoid of level 1 - alpha",
            "",
            |t| ellipsoid_hull(t, q(1)),
        )
        .twin("nine tenths of varsigma", |t| ellipsoid_hull(t, frac(9, 10))),
        claim(
            "lemma-2-level",
            "(a remark of ours) the probability of the confidence box is more than 1 - alpha",
            "it is 1 - alpha in one dimension, and larger from two dimensions on",
            |t| level(t, q(1)),
        )
        .class(Class::Remark)
        .twin("a box a quarter larger than its ellipsoid", |t| level(t, frac(5, 4))),
        claim(
            "remark-1",
            "any nonlinearity with respect to x is placed in A: f(x) = A(x) x, up to the constant f(0), which B u carries",
            "a system with f(0) != 0 is refused unless the input or the noise carries f(0)",
            |t| quasi_lpv(t, true),
        )
        .twin("without the constant", |t| quasi_lpv(t, false)),
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
fn sum_of_gaussians(t: &mut Trial, cross: i64) {
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
        let own = q(3) * &a * &a + q(cross) * &a * &b + q(3) * &b * &b;
        let sum = a + b;
        t.repaired(own == q(3) * &sum * &sum);
    }
}

fn absolute_matrix(t: &mut Trial, by_entries: bool) {
    for _ in 0..300 {
        let d = t.draw.vector(2, 4);
        let (m, bar) = spectral(&mut t.draw, &d);
        let bar = if by_entries { m.abs() } else { bar };
        let zeta = t.draw.unit();
        t.check(bar.is_psd() && bar.sub(&m.scale(&zeta)).is_psd());
    }
}

/// (10) and (11), and what a damaged twin makes of them.
struct Operations {
    /// |G| in (10), not G.
    absolute: bool,
    /// The part of L in (11).
    l: Q,
}

impl Operations {
    fn whole() -> Self {
        Self {
            absolute: true,
            l: q(1),
        }
    }
}

fn operations(t: &mut Trial, how: &Operations) {
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
        let r: V = if how.absolute {
            x.g.row_sums()
        } else {
            (0..n).map(|i| x.g.row(i).iter().sum::<Q>()).collect()
        };
        let hull = (0..n).map(|i| (&x.c[i] - &r[i], &x.c[i] + &r[i])).collect();
        t.check(x.hull() == Some(hull));
        let rad = t.draw.matrix(n, x.g.cols(), 1).abs();
        let wide = x.sum(&Cz::boxed(
            vec![Q::zero(); n],
            &scale(&how.l, &rad.row_sums()),
        ));
        // The member that goes farthest along d: ξ at a corner, and G moved outwards by its radius.
        let sign = |x: &Q| q(if x.is_negative() { -1 } else { 1 });
        let xi: V = x.g.t().apply(&d).iter().map(sign).collect();
        let member = M::from_fn(n, x.g.cols(), |i, j| {
            &x.g[(i, j)] + sign(&d[i]) * &xi[j] * &rad[(i, j)]
        });
        t.check(wide.contains(&add(&x.c, &member.apply(&xi))));
    }
}

/// The ellipsoid {x : xᵀ P⁻¹ x ≤ ς} reaches exactly √(ς P_ii) along axis i, at x = P eᵢ √(ς / P_ii).
fn ellipsoid_hull(t: &mut Trial, part: Q) {
    for _ in 0..300 {
        let p = t.draw.definite(2);
        let Some(inverse) = p.inverse() else { continue };
        let x = t.draw.direction(2, 5);
        let level = dot(&x, &inverse.apply(&x));
        for i in 0..2 {
            t.check(&x[i] * &x[i] <= &level * &p[(i, i)]);
            let touch = p.col(i);
            let level = dot(&touch, &inverse.apply(&touch)) * &part;
            t.check(&touch[i] * &touch[i] == level * &p[(i, i)]);
        }
    }
}

/// The box holds the ellipsoid; it has the same probability only if it holds nothing else.
fn level(t: &mut Trial, size: Q) {
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
            let corner: V = (0..n)
                .map(|i| &signs[i] * below_root(&p[(i, i)]) * &size)
                .collect();
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

/// A polynomial is its constant and x times a polynomial.
fn quasi_lpv(t: &mut Trial, constant: bool) {
    for _ in 0..300 {
        let f = t.draw.vector(4, 3);
        let x = t.draw.unit();
        let at = |f: &[Q]| f.iter().rev().fold(Q::zero(), |s, f| s * &x + f);
        let carried = if constant { f[0].clone() } else { Q::zero() };
        t.check(at(&f[1..]) * &x + carried == at(&f));
    }
}
