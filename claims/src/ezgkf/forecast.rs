//! Propositions 1 and 2, Remark 3: the forecast under a scheduling parameter.

use super::claim;
use super::preliminaries::{rotation, spectral};
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, norm1, q, scale};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "proposition-1",
            "(25) encloses A(delta) z + Delta c + w for delta in [-1, 1]^n",
            "also for delta that depends on the state: safe for quasi-LPV systems",
            zonotope,
        ),
        claim(
            "proposition-2",
            "(26) bounds the covariance of A(delta) g + w for delta in [-1, 1]^n that does not depend on g",
            "the overbars of (26) are needed",
            covariance,
        ),
        claim(
            "proposition-2-quasi-lpv",
            "(26) bounds the covariance of A(delta) g + w in the quasi-LPV case, delta a function of the state",
            "P is no covariance bound there; what remains: g in E(sP) gives A(delta) g in E(s P^), one step",
            covariance_of_states,
        ),
        claim(
            "remark-3",
            "the interval form encloses A(delta) z + Delta c + w, with n_g + n_gw + 2n generators",
            "never smaller than (25)",
            interval_form,
        ),
        claim(
            "remark-3-set",
            "with one entry in each A_i the interval form is the same set as (25)",
            "EZGKF-M differs by its list of generators, hence by its gain; merged, n parallel columns suffice",
            same_set,
        ),
        claim(
            "section-V-interval",
            "the state matrix of V-B is really interval, unlike that of V-A, which is affine",
            "both are both: EZGKF-M applies to case A as well",
            case_a_is_interval,
        ),
    ]
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
    fn affine(&self) -> Cz {
        let mut g = self.a0.mul(&self.g).beside(&self.w);
        let column = M::from_fn(self.c.len(), 1, |i, _| self.c[i].clone());
        for a in &self.a {
            g = g.beside(&a.mul(&column)).beside(&a.mul(&self.g));
        }
        Cz::zonotope(g, vec![Q::zero(); self.c.len()])
    }

    /// Remark 3: [A_0 G, diag(rad A |G| 1), G_w, diag(rad A |c|)].
    fn interval(&self) -> Cz {
        let n = self.c.len();
        let rad = self.a.iter().fold(M::zeros(n, n), |s, a| s.add(&a.abs()));
        let absolute: V = self.c.iter().map(Signed::abs).collect();
        let g = self
            .a0
            .mul(&self.g)
            .beside(&M::diag(&rad.mul(&self.g.abs()).row_sums()))
            .beside(&self.w)
            .beside(&M::diag(&rad.apply(&absolute)));
        Cz::zonotope(g, vec![Q::zero(); n])
    }

    /// A(δ) z + Δ c + w; δ is drawn, or the sign that goes farthest along `d`, which depends on z.
    fn member(&self, draw: &mut Source, d: &[Q]) -> V {
        let z = self.g.apply(&draw.units(self.g.cols()));
        let dependent = draw.int(0, 1) == 1;
        let mut out = add(&self.a0.apply(&z), &self.w.apply(&draw.units(1)));
        let both = add(&z, &self.c);
        for a in &self.a {
            let term = a.apply(&both);
            let delta = if dependent {
                q(if dot(d, &term).is_negative() { -1 } else { 1 })
            } else {
                draw.unit()
            };
            out = add(&out, &scale(&delta, &term));
        }
        out
    }
}

fn support(z: &Cz, d: &[Q]) -> Q {
    dot(&z.c, d) + norm1(&z.g.t().apply(d))
}

fn zonotope(t: &mut Trial) {
    for _ in 0..400 {
        let i = Instance::drawn(&mut t.draw, false);
        let d = t.draw.direction(2, 3);
        let set = i.affine();
        let x = i.member(&mut t.draw, &d);
        t.check(dot(&d, &x) <= support(&set, &d));
        t.check(set.g.cols() == i.g.cols() + i.w.cols() + i.a.len() * (1 + i.g.cols()));
    }
}

fn interval_form(t: &mut Trial) {
    for _ in 0..400 {
        let i = Instance::drawn(&mut t.draw, false);
        let d = t.draw.direction(2, 3);
        let set = i.interval();
        let x = i.member(&mut t.draw, &d);
        t.check(dot(&d, &x) <= support(&set, &d));
        t.check(set.g.cols() == i.g.cols() + i.w.cols() + 4);
        t.check(support(&set, &d) >= support(&i.affine(), &d));
    }
}

fn same_set(t: &mut Trial) {
    for _ in 0..600 {
        let i = Instance::drawn(&mut t.draw, true);
        let d = t.draw.direction(2, 3);
        t.check(support(&i.interval(), &d) == support(&i.affine(), &d));
    }
}

/// A_0 = I, P = I, and A_i such that every overbar of (26) is rational: multiples of rotations, or symmetric
/// matrices with the same eigenvectors.
fn spread(draw: &mut Source, count: usize) -> (Vec<M>, M) {
    if draw.int(0, 1) == 1 {
        let a: Vec<M> = (0..count)
            .map(|_| rotation(draw).scale(&frac(draw.int(1, 4), 2)))
            .collect();
        // sym(Oᵢ Oⱼᵀ) is a multiple of I.
        let mut sum = Q::zero();
        for i in 0..count {
            sum += (&a[i][(0, 0)] * q(2)).abs();
            sum += a[i].mul(&a[i].t())[(0, 0)].clone();
            for j in i + 1..count {
                sum += (a[i].mul(&a[j].t())[(0, 0)].clone() * q(2)).abs();
            }
        }
        let bar = M::identity(2).scale(&(sum + q(1)));
        return (a, bar);
    }
    let base = rotation(draw);
    let d: Vec<V> = (0..count).map(|_| draw.vector(2, 2)).collect();
    let with = |d: &[Q]| base.mul(&M::diag(d)).mul(&base.t());
    let mut bar = M::identity(2);
    for i in 0..count {
        let own: V = d[i].iter().map(|x| (x * q(2)).abs() + x * x).collect();
        bar = bar.add(&with(&own));
        for j in i + 1..count {
            let cross: V = (0..2).map(|k| (&d[i][k] * &d[j][k] * q(2)).abs()).collect();
            bar = bar.add(&with(&cross));
        }
    }
    (d.iter().map(|d| with(d)).collect(), bar)
}

fn closed(a: &[M], delta: &[Q]) -> M {
    a.iter()
        .zip(delta)
        .fold(M::identity(2), |s, (a, d)| s.add(&a.scale(d)))
}

fn covariance(t: &mut Trial) {
    for _ in 0..300 {
        let count = t.draw.size(1, 3);
        let (a, bar) = spread(&mut t.draw, count);
        let m = closed(&a, &t.draw.units(count));
        t.check(bar.sub(&m.mul(&m.t())).is_psd());
        // One A with any antisymmetric part: A_0 P A' + A P A_0' = 2 sym(A).
        let d = t.draw.vector(2, 3);
        let (s, s_bar) = spectral(&mut t.draw, &d);
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
fn covariance_of_states(t: &mut Trial) {
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
        let (a, bar) = spread(&mut t.draw, 1);
        let g = t.draw.direction(2, 3);
        let sign = t.draw.sign();
        let x = closed(&a, &[sign]).apply(&g);
        let level = bar.inverse().map(|i| dot(&x, &i.apply(&x)));
        t.repaired(level.is_some_and(|level| level <= dot(&g, &g)));
    }
}

/// The interval matrix [A_0 − |A_1|, A_0 + |A_1|] of both case studies: A_1 has one entry.
fn case_a_is_interval(t: &mut Trial) {
    let case_a = |z: &Q| {
        let mut a = M::zeros(2, 2);
        a[(1, 1)] = -frac(1, 10) * z;
        a
    };
    let mut case_b = M::zeros(2, 2);
    case_b[(1, 1)] = frac(3, 10);
    // Affine and not interval: some matrix between the bounds is not A_0 + δ A_1.
    let not_interval = |a: &M| {
        let entries = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
        entries.filter(|&at| !a[at].is_zero()).count() > 1
    };
    let first = case_a(&q(1));
    t.check_or(not_interval(&first), || {
        format!(
            "V-A: A1 = rad(z) {}, V-B: A1 = {}: one entry each, so both families are interval matrices",
            first.text(),
            case_b.text()
        )
    });
    t.repaired(!not_interval(&case_b));
    for _ in 0..50 {
        let z = q(t.draw.int(1, 40)) / q(8);
        t.check(not_interval(&case_a(&z)));
    }
}
