//! Propositions 1 and 2, Remark 3: the forecast under a scheduling parameter.

use super::claim;
use super::preliminaries::{rotation, spectral};
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, norm1, q};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "proposition-1",
            "(25) encloses A(delta) z + Delta c + w for delta in [-1, 1]^n",
            "also for delta that depends on the state: safe for quasi-LPV systems",
            |t| zonotope(t, &Phi::whole()),
        )
        .twin("nine tenths of Phi", |t| {
            zonotope(t, &Phi { part: frac(9, 10), ..Phi::whole() })
        })
        .twin("A_i c left out of Phi", |t| zonotope(t, &Phi { center: false, ..Phi::whole() }))
        .twin("G^w left out", |t| zonotope(t, &Phi { noise: false, ..Phi::whole() })),
        claim(
            "proposition-2",
            "(26), with the overbars that its proof applies, bounds the covariance of A(delta) g + w for delta in [-1, 1]^n \
             that does not depend on g",
            "the overbars of (26), which our text has lost, are needed",
            |t| covariance(t, true),
        )
        .twin("the overbars left out", |t| covariance(t, false)),
        claim(
            "proposition-2-quasi-lpv",
            "(26) bounds the covariance of A(delta) g + w for the scheduling parameter delta \"containing state information\"",
            "its proof holds A fixed inside E; P is no covariance bound in the quasi-LPV case. What remains: g in E(sP) gives \
             A(delta) g in E(s P^), one step",
            |t| covariance_of_states(t, q(1)),
        )
        .twin("nine tenths of P^", |t| covariance_of_states(t, frac(9, 10))),
        claim(
            "remark-3",
            "the interval form encloses A(delta) z + Delta c + w, with n_g + n_gw + 2n generators",
            "never smaller than (25)",
            |t| interval_form(t, &Blocks::whole()),
        )
        .twin("nine tenths of the block of G", |t| {
            interval_form(t, &Blocks { set: frac(9, 10), ..Blocks::whole() })
        })
        .twin("nine tenths of the block of c", |t| {
            interval_form(t, &Blocks { center: frac(9, 10), ..Blocks::whole() })
        }),
        claim(
            "remark-3-set",
            "(a remark of ours) with one entry in each A_i the interval form is the same set as (25)",
            "EZGKF-M differs by its list of generators, hence by its gain; merged, n parallel columns suffice",
            |t| same_set(t, &Blocks::whole()),
        )
        .class(Class::Remark)
        .twin("nine tenths of the block of c", |t| {
            same_set(t, &Blocks { center: frac(9, 10), ..Blocks::whole() })
        }),
        claim(
            "section-V-interval",
            "the state matrix of V-B is an interval matrix, and that of V-A is affine in the scheduling parameter",
            "",
            |t| kinds_of_matrices(t, &[(1, 1)]),
        )
        .twin("a second entry of A_1 in V-B, moved by the same delta", |t| {
            kinds_of_matrices(t, &[(1, 1), (0, 1)])
        }),
        claim(
            "section-V-both",
            "(a remark of ours) that of V-A is an interval matrix as well: EZGKF-M applies there too",
            "one entry of A_1 each; what differs is that the paper makes delta of V-A from the state, and that of V-B comes from outside",
            |t| both_are_intervals(t, &[(1, 1)]),
        )
        .class(Class::Remark)
        .twin("a second entry of A_1 in V-A", |t| both_are_intervals(t, &[(1, 1), (0, 1)])),
    ]
}

/// The blocks of (25), and what a damaged twin leaves of them.
struct Phi {
    part: Q,
    center: bool,
    noise: bool,
}

impl Phi {
    fn whole() -> Self {
        Self {
            part: q(1),
            center: true,
            noise: true,
        }
    }
}

/// The diagonal blocks of Remark 3, and what a damaged twin leaves of them.
struct Blocks {
    set: Q,
    center: Q,
}

impl Blocks {
    fn whole() -> Self {
        Self {
            set: q(1),
            center: q(1),
        }
    }
}

/// An instance: A_0, the A_i, prior generators, centre, noise generators.
struct Instance {
    a0: M,
    a: Vec<M>,
    g: M,
    c: V,
    w: M,
}

impl Instance {
    fn drawn(draw: &mut Source, single: bool) -> Self {
        let n = 2;
        let count = draw.size(1, 2);
        let a = (0..count)
            .map(|k| {
                if single {
                    // One entry each, at different places.
                    let (row, col) = (draw.size(0, 1), k);
                    let value = q(draw.int(1, 3));
                    M::from_fn(n, n, |i, j| {
                        if (i, j) == (row, col) {
                            value.clone()
                        } else {
                            q(0)
                        }
                    })
                } else {
                    draw.matrix(n, n, 2)
                }
            })
            .collect();
        Self {
            a0: draw.matrix(n, n, 2),
            a,
            g: draw.matrix(n, 2, 2),
            c: draw.vector(n, 2),
            w: draw.matrix(n, 1, 1),
        }
    }

    /// (25): [A_0 G, G_w, A_i c, A_i G].
    fn affine(&self, phi: &Phi) -> Cz {
        let noise = self.w.scale(&q(i64::from(phi.noise)));
        let mut g = self.a0.mul(&self.g).beside(&noise);
        let column = M::from_fn(self.c.len(), 1, |i, _| self.c[i].clone());
        let column = column.scale(&q(i64::from(phi.center)));
        for a in &self.a {
            let block = a.mul(&column).beside(&a.mul(&self.g));
            g = g.beside(&block.scale(&phi.part));
        }
        Cz::zonotope(g, vec![Q::zero(); self.c.len()])
    }

    /// Remark 3: [A_0 G, diag(rad A |G| 1), G_w, diag(rad A |c|)].
    fn interval(&self, blocks: &Blocks) -> Cz {
        let n = self.c.len();
        let rad = self.a.iter().fold(M::zeros(n, n), |s, a| s.add(&a.abs()));
        let absolute: V = self.c.iter().map(Signed::abs).collect();
        let g = self
            .a0
            .mul(&self.g)
            .beside(&M::diag(&rad.mul(&self.g.abs()).row_sums()).scale(&blocks.set))
            .beside(&self.w)
            .beside(&M::diag(&rad.apply(&absolute)).scale(&blocks.center));
        Cz::zonotope(g, vec![Q::zero(); n])
    }

    /// The A(δ) z + Δ c + w that goes farthest along `d`: δ at a corner of its box, z and w at the vertices of their
    /// zonotopes that then go farthest. Depending on z, δ may be any corner.
    fn farthest(&self, d: &[Q]) -> V {
        let sign = |x: &Q| q(if x.is_negative() { -1 } else { 1 });
        let vertex = |g: &M, d: &[Q]| g.apply(&g.t().apply(d).iter().map(sign).collect::<V>());
        let corners = 0..1_usize << self.a.len();
        let members = corners.map(|bits| {
            let signs = (0..self.a.len()).map(|i| q(if bits >> i & 1 == 1 { 1 } else { -1 }));
            let n = self.c.len();
            let delta = self
                .a
                .iter()
                .zip(signs)
                .fold(M::zeros(n, n), |s, (a, sign)| s.add(&a.scale(&sign)));
            let a = self.a0.add(&delta);
            let z = vertex(&self.g, &a.t().apply(d));
            add(
                &add(&a.apply(&z), &delta.apply(&self.c)),
                &vertex(&self.w, d),
            )
        });
        members.max_by_key(|x| dot(x, d)).unwrap_or_default()
    }
}

fn support(z: &Cz, d: &[Q]) -> Q {
    dot(&z.c, d) + norm1(&z.g.t().apply(d))
}

fn zonotope(t: &mut Trial, phi: &Phi) {
    for _ in 0..400 {
        let i = Instance::drawn(&mut t.draw, false);
        let d = t.draw.direction(2, 3);
        let set = i.affine(phi);
        let x = i.farthest(&d);
        t.check(dot(&d, &x) <= support(&set, &d));
        t.check(set.g.cols() == i.g.cols() + i.w.cols() + i.a.len() * (1 + i.g.cols()));
    }
}

fn interval_form(t: &mut Trial, blocks: &Blocks) {
    for _ in 0..400 {
        let i = Instance::drawn(&mut t.draw, false);
        let d = t.draw.direction(2, 3);
        let set = i.interval(blocks);
        let x = i.farthest(&d);
        t.check(dot(&d, &x) <= support(&set, &d));
        t.check(set.g.cols() == i.g.cols() + i.w.cols() + 4);
        t.check(support(&set, &d) >= support(&i.affine(&Phi::whole()), &d));
    }
}

fn same_set(t: &mut Trial, blocks: &Blocks) {
    for _ in 0..600 {
        let i = Instance::drawn(&mut t.draw, true);
        let d = t.draw.direction(2, 3);
        t.check(support(&i.interval(blocks), &d) == support(&i.affine(&Phi::whole()), &d));
    }
}

/// A_0 = I, P = I, and A_i such that every overbar of (26) is rational: multiples of rotations, or symmetric
/// matrices with the same eigenvectors. The second is (26), with the overbars or without.
fn spread(draw: &mut Source, count: usize, bars: bool) -> (Vec<M>, M) {
    let bar = |x: Q| if bars { x.abs() } else { x };
    if draw.int(0, 1) == 1 {
        let a: Vec<M> = (0..count)
            .map(|_| rotation(draw).scale(&frac(draw.int(1, 4), 2)))
            .collect();
        // sym(Oᵢ Oⱼᵀ) is a multiple of I.
        let mut sum = Q::zero();
        for i in 0..count {
            sum += bar(&a[i][(0, 0)] * q(2));
            sum += a[i].mul(&a[i].t())[(0, 0)].clone();
            for j in i + 1..count {
                sum += bar(a[i].mul(&a[j].t())[(0, 0)].clone() * q(2));
            }
        }
        let bar = M::identity(2).scale(&(sum + q(1)));
        return (a, bar);
    }
    let base = rotation(draw);
    let d: Vec<V> = (0..count).map(|_| draw.vector(2, 2)).collect();
    let with = |d: &[Q]| base.mul(&M::diag(d)).mul(&base.t());
    let mut bound = M::identity(2);
    for i in 0..count {
        let own: V = d[i].iter().map(|x| bar(x * q(2)) + x * x).collect();
        bound = bound.add(&with(&own));
        for j in i + 1..count {
            let cross: V = (0..2).map(|k| bar(&d[i][k] * &d[j][k] * q(2))).collect();
            bound = bound.add(&with(&cross));
        }
    }
    (d.iter().map(|d| with(d)).collect(), bound)
}

fn closed(a: &[M], delta: &[Q]) -> M {
    a.iter()
        .zip(delta)
        .fold(M::identity(2), |s, (a, d)| s.add(&a.scale(d)))
}

fn covariance(t: &mut Trial, bars: bool) {
    for _ in 0..300 {
        let count = t.draw.size(1, 3);
        let (a, bar) = spread(&mut t.draw, count, bars);
        let m = closed(&a, &t.draw.units(count));
        t.check(bar.sub(&m.mul(&m.t())).is_psd());
        // One A with any antisymmetric part: A_0 P A' + A P A_0' = 2 sym(A).
        let d = t.draw.vector(2, 3);
        let (s, s_bar) = spectral(&mut t.draw, &d);
        let s_bar = if bars { s_bar } else { s.clone() };
        let k = q(t.draw.int(-2, 2));
        let a = s.add(&M::of_rows(2, &[vec![q(0), -k.clone()], vec![k, q(0)]]));
        let bar = M::identity(2).add(&s_bar.scale(&q(2))).add(&a.mul(&a.t()));
        let m = closed(&[a], &t.draw.units(1));
        t.check(bar.sub(&m.mul(&m.t())).is_psd());
    }
}

/// A_0 = P = I, Q = 0, A_1 = s O with a rotation by φ, δ = sign((d·g)(d·A_1 g)): then E[(d·x)²] =
/// |d|² + s²|d|² + 2 s E|UV| |d|² for normal U, V of correlation ρ = cos φ, and (26) allows 2 s |ρ| in place of
/// 2 s E|UV| = (4 s/π)(√(1−ρ²) + ρ asin ρ) ≥ (14 s/11)(|sin φ| + ρ²), by π < 22/7 and asin ρ ≥ ρ.
fn covariance_of_states(t: &mut Trial, part: Q) {
    let excess = |o: &M| {
        let (rho, sin) = (o[(0, 0)].abs(), o[(1, 0)].abs());
        frac(14, 11) * (sin + &rho * &rho) - q(2) * rho
    };
    let quarter = M::ints(&[&[0, -1], &[1, 0]]);
    let over = excess(&quarter);
    t.check_or(!over.is_positive(), || {
        format!(
            "A0 = I, A1 = [0 -1; 1 0], P = I, Q = 0, delta = -sign(g1 g2): (26) gives 2, E[x1^2] = 2 + 4/pi > 2 + {over}"
        )
    });
    for _ in 0..300 {
        let o = rotation(&mut t.draw);
        t.check(!excess(&o).is_positive());
        // What remains: one point, δ chosen by it.
        let (a, bar) = spread(&mut t.draw, 1, true);
        let g = t.draw.direction(2, 3);
        let sign = t.draw.sign();
        let x = closed(&a, &[sign]).apply(&g);
        let level = bar.scale(&part).inverse().map(|i| dot(&x, &i.apply(&x)));
        t.repaired(level.is_some_and(|level| level <= dot(&g, &g)));
    }
}

/// A_1 with `value` at these places.
fn spread_at(places: &[(usize, usize)], value: &Q) -> M {
    M::from_fn(2, 2, |i, j| {
        if places.contains(&(i, j)) {
            value.clone()
        } else {
            Q::zero()
        }
    })
}

/// Whether some δ in [−1, 1] has δ A_1 = `delta`.
fn is_multiple(a1: &M, delta: &M) -> bool {
    let at = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
    let ratio = at
        .clone()
        .find(|&at| !a1[at].is_zero())
        .map(|at| &delta[at] / &a1[at]);
    ratio.is_some_and(|d| d.abs() <= q(1) && at.clone().all(|at| delta[at] == &a1[at] * &d))
}

/// A matrix between −|A_1| and |A_1|.
fn between(draw: &mut Source, a1: &M) -> M {
    M::from_fn(2, 2, |i, j| draw.unit() * &a1[(i, j)])
}

/// V-B: every matrix of [A_0 − |A_1|, A_0 + |A_1|] is some A_0 + δ A_1. V-A: A is affine in z = x_1², over the interval
/// [z] with δ = (z − mid) / rad.
fn kinds_of_matrices(t: &mut Trial, places: &[(usize, usize)]) {
    let case_b = spread_at(places, &frac(3, 10));
    for _ in 0..50 {
        let delta = between(&mut t.draw, &case_b);
        t.check(is_multiple(&case_b, &delta));
        let (mid, rad) = (q(t.draw.int(0, 8)), frac(t.draw.int(1, 8), 4));
        let a = |z: &Q| {
            M::of_rows(
                2,
                &[
                    vec![q(1), frac(1, 10)],
                    vec![-frac(1, 10), frac(11, 10) - z / q(10)],
                ],
            )
        };
        let delta = t.draw.unit();
        let a1 = spread_at(&[(1, 1)], &(-&rad / q(10)));
        t.check(a(&(&mid + &rad * &delta)) == a(&mid).add(&a1.scale(&delta)));
    }
}

fn both_are_intervals(t: &mut Trial, places: &[(usize, usize)]) {
    for _ in 0..50 {
        let rad = frac(t.draw.int(1, 40), 8);
        let case_a = spread_at(places, &(-rad / q(10)));
        let delta = between(&mut t.draw, &case_a);
        t.check(is_multiple(&case_a, &delta));
    }
}
