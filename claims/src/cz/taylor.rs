//! Section 4.2: the first-order Taylor extension.

use super::claim;
use super::extensions::{Intervals, eliminated, inclusion_of};
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, q, scale, sub};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-3",
            "eta(Z) is contained in eta(h) + grad(h)(Z - h) + R for every h in Z, with L = (c - h)' Q",
            "not an enclosure for h != c, because Q is triangular: L = (c - h)' (Q + Q')/2 is one",
            enclosure,
        ),
        claim(
            "corollary-2",
            "for h = c in Z the last term of R vanishes and the enclosure holds",
            "the choice C4 is guaranteed as printed",
            centred,
        ),
        claim(
            "remark-8",
            "(15) has m_g^2/2 + 5 m_g/2 + 2n generators and m_c^2/2 + 5 m_c/2 constraints",
            "",
            size,
        ),
        claim(
            "remark-10",
            "iterated computations of Theorems 2 and 3 and (22) increase the complexity at most quadratically",
            "quadratic for one step only: the sets have to be reduced in every step",
            growth,
        ),
    ]
}

/// η_q(z) = zᵀ H_q z + l_q·z with H_q upper triangular, and a widening of the bound on H_q.
struct Function {
    h: Vec<M>,
    rad: Vec<M>,
    l: M,
}

impl Function {
    fn drawn(draw: &mut Source, n: usize, m: usize) -> Self {
        let mut upper = |size: i64| {
            M::from_fn(m, m, |i, j| {
                q(if i <= j { draw.int(-size, size) } else { 0 })
            })
        };
        let h = (0..n).map(|_| upper(2)).collect();
        let rad = (0..n).map(|_| upper(1).abs().scale(&frac(1, 2))).collect();
        let l = draw.matrix(n, m, 1);
        Self { h, rad, l }
    }

    fn at(&self, z: &[Q]) -> V {
        let square: V = self.h.iter().map(|h| dot(z, &h.apply(z))).collect();
        add(&square, &self.l.apply(z))
    }

    fn gradient(&self, z: &[Q]) -> M {
        let rows: Vec<V> = self
            .h
            .iter()
            .enumerate()
            .map(|(i, h)| add(&h.add(&h.t()).apply(z), self.l.row(i)))
            .collect();
        M::of_rows(z.len(), &rows)
    }
}

/// (15), with the printed L or the symmetric one.
fn taylor(f: &Function, z: &Cz, h: &[Q], symmetric: bool) -> Cz {
    let (n, m, mg) = (f.h.len(), z.c.len(), z.g.cols());
    let p = sub(&z.c, h);
    let half = frac(1, 2);
    let mut center = Vec::new();
    let mut rows = Vec::new();
    let mut widths = Vec::new();
    let (mut mid, mut rad) = (Vec::new(), Vec::new());
    let pairs: Vec<(usize, usize)> = (0..mg)
        .flat_map(|i| (i + 1..mg).map(move |j| (i, j)))
        .collect();
    let absolute: V = p.iter().map(Signed::abs).collect();
    for (h, r) in f.h.iter().zip(&f.rad) {
        let q_mid = z.g.t().mul(h).mul(&z.g);
        let q_rad = z.g.abs().t().mul(r).mul(&z.g.abs());
        center.push(q_mid.trace() * &half);
        let mut row: V = (0..mg).map(|i| &q_mid[(i, i)] * &half).collect();
        row.extend(pairs.iter().map(|&(i, j)| &q_mid[(i, j)] + &q_mid[(j, i)]));
        rows.push(row);
        widths.push(q_rad.row_sums().iter().fold(Q::zero(), |s, w| s + w));
        let (h, r) = if symmetric {
            (h.add(&h.t()).scale(&half), r.add(&r.t()).scale(&half))
        } else {
            (h.clone(), r.clone())
        };
        mid.push(h.t().apply(&p));
        rad.push(r.t().apply(&absolute));
    }
    let terms = mg + pairs.len();
    let mut constraints = Vec::new();
    let mut right = Vec::new();
    for r in 0..z.a.rows() {
        for s in r..z.a.rows() {
            let square = |i: usize| &z.a[(r, i)] * &z.a[(s, i)] * &half;
            let mut row: V = (0..mg).map(square).collect();
            row.extend(
                pairs
                    .iter()
                    .map(|&(i, j)| &z.a[(r, i)] * &z.a[(s, j)] + &z.a[(r, j)] * &z.a[(s, i)]),
            );
            constraints.push(row);
            right.push(&z.b[r] * &z.b[s] - (0..mg).fold(Q::zero(), |t, i| t + square(i)));
        }
    }
    let remainder = Cz {
        g: M::of_rows(terms, &rows),
        c: center,
        a: M::of_rows(terms, &constraints),
        b: right,
    }
    .sum(&Cz::boxed(vec![Q::zero(); n], &widths));
    let l = Intervals {
        mid: M::of_rows(m, &mid),
        rad: M::of_rows(m, &rad),
    };
    let shifted = Cz {
        g: z.g.scale(&q(2)),
        c: p,
        ..z.clone()
    };
    let last = inclusion_of(&l, &shifted, &eliminated(&shifted));
    let mut first = z.about(h).image(&f.gradient(h));
    first.c = add(&first.c, &f.at(h));
    first.sum(&remainder).sum(&last)
}

/// η = z1 z2 over [−1, 1] × [0, 2].
fn product() -> (Function, Cz) {
    let f = Function {
        h: vec![M::ints(&[&[0, 1], &[0, 0]])],
        rad: vec![M::zeros(2, 2)],
        l: M::zeros(1, 2),
    };
    (f, Cz::boxed(vec![q(0), q(1)], &[q(1), q(1)]))
}

fn enclosure(t: &mut Trial) {
    let (f, z) = product();
    let h = vec![q(0), q(0)];
    let hull = taylor(&f, &z, &h, false).hull().unwrap_or_default();
    let truth = f.at(&[q(1), q(2)]);
    t.check_or(hull[0].1 >= truth[0], || {
        format!(
            "eta = z1 z2, c = (0, 1), G = I, h = (0, 0): printed [{}, {}], but eta(1, 2) = {}",
            hull[0].0, hull[0].1, truth[0]
        )
    });
    for k in 0..240 {
        let (n, m) = (t.draw.size(1, 2), 2);
        let constraints = t.draw.size(0, 1);
        let (z, f) = if k % 4 == 0 {
            (
                t.draw.cz(m, 2 + constraints, constraints),
                Function::drawn(&mut t.draw, n, m),
            )
        } else {
            // A box and a known constant Hessian: the remainder has no slack to hide the error.
            let mut f = Function::drawn(&mut t.draw, 1, m);
            f.rad = vec![M::zeros(m, m)];
            (Cz::boxed(t.draw.vector(m, 2), &[q(1), q(1)]), f)
        };
        let points = z.points(&mut t.draw, 5);
        let Some(h) = points.last() else { continue };
        if *h == z.c {
            continue;
        }
        let printed = taylor(&f, &z, h, false);
        let symmetric = taylor(&f, &z, h, true);
        for x in &points {
            let y = f.at(x);
            t.check(printed.contains(&y));
            t.repaired(symmetric.contains(&y));
        }
    }
}

fn centred(t: &mut Trial) {
    for _ in 0..80 {
        let n = t.draw.size(1, 2);
        let constraints = t.draw.size(0, 1);
        let mut z = t.draw.cz(2, 2 + constraints, constraints);
        // ξ = 0 satisfies the constraints, so that the centre lies in the set.
        z.b = vec![Q::zero(); constraints];
        let f = Function::drawn(&mut t.draw, n, 2);
        let set = taylor(&f, &z, &z.c, false);
        for x in z.points(&mut t.draw, 4) {
            t.check(set.contains(&f.at(&x)));
        }
        let last = set.g.cols() - n..set.g.cols();
        t.check(last.clone().all(|j| set.g.col(j).iter().all(Zero::is_zero)));
    }
}

fn size(t: &mut Trial) {
    for _ in 0..60 {
        let (n, m) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let constraints = t.draw.size(0, 3);
        let z = t.draw.cz(m, m + constraints, constraints);
        let f = Function::drawn(&mut t.draw, n, m);
        let set = taylor(&f, &z, &scale(&q(1), &z.c), true);
        let (mg, mc) = (z.g.cols(), z.a.rows());
        t.check(2 * set.g.cols() == mg * mg + 5 * mg + 4 * n);
        t.check(2 * set.a.rows() == mc * mc + 5 * mc);
    }
}

/// Generators after `steps` first-order predictions of n states from m generators.
fn generators(m: i64, n: i64, steps: usize) -> i64 {
    (0..steps).fold(m, |m, _| (m * m + 5 * m) / 2 + 2 * n)
}

fn growth(t: &mut Trial) {
    let chain: Vec<String> = (0..4).map(|k| generators(2, 1, k).to_string()).collect();
    for steps in 1..4 {
        for n in 1..4 {
            for m in 1..20 {
                // Quadratic in m: the third difference vanishes.
                let at = |d: i64| generators(m + d, n, steps);
                let quadratic = at(3) - 3 * at(2) + 3 * at(1) - at(0) == 0;
                t.check_or(quadratic, || {
                    format!("one state, two generators, Theorem 3: {}", chain.join(", "))
                });
                if steps == 1 {
                    t.repaired(quadratic);
                }
            }
        }
    }
}
