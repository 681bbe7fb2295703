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
            |t| enclosure(t, Terms::All),
        )
        .twin("G_d left out of the symmetric form", |t| {
            enclosure(t, Terms::WithoutDiagonal);
        })
        .twin("rad(L) left out of the symmetric form", |t| {
            enclosure(t, Terms::WithoutRadius);
        }),
        claim(
            "remark-6",
            "the order of the indices i < j and r <= s is irrelevant, as long as it is the same for all variables",
            "",
            |t| order_of_indices(t, false),
        )
        .twin("another order in G~ than in A~", |t| order_of_indices(t, true)),
        claim(
            "remark-7",
            "Q by interval arithmetic over the hull, and G' Q G and (c - h)' Q by interval arithmetic, satisfy Theorem 3",
            "",
            |t| interval_bounds(t, false),
        )
        .twin("the hull's width halved", |t| interval_bounds(t, true)),
        claim(
            "corollary-2",
            "for h = c in Z the last term of R vanishes and the enclosure holds",
            "the choice C4 is guaranteed as printed",
            |t| centred(t, Terms::All),
        )
        .twin("G_d left out", |t| centred(t, Terms::WithoutDiagonal)),
        claim(
            "remark-8",
            "(15) has m_g^2/2 + 5 m_g/2 + 2n generators and m_c^2/2 + 5 m_c/2 constraints",
            "",
            |t| size(t, Terms::All),
        )
        .twin("the products of a constraint with itself left out", |t| {
            size(t, Terms::WithoutSquares);
        }),
        claim(
            "remark-10",
            "iterated computations of Theorems 2 and 3 and (22) increase the complexity at most quadratically",
            "of one step so; over k steps without reduction the degree is 2^k: the sets are reduced in every step",
            |t| growth(t, 1),
        )
        .twin("two steps", |t| growth(t, 2)),
    ]
}

/// What of (15) is kept; all but `All` are damage, but for the order of the pairs.
#[derive(Clone, Copy, PartialEq)]
enum Terms {
    All,
    WithoutDiagonal,
    WithoutRadius,
    WithoutSquares,
    /// Pairs i < j and r ≤ s in reverse order.
    Reversed,
    /// In G̃ alone.
    ReversedHalf,
}

/// η_q(z) = zᵀ H_q z + l_q·z with H_q upper triangular at a corner of its bound Q, of which `mid` and `rad` are known.
struct Function {
    h: Vec<M>,
    mid: Vec<M>,
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
        let mid: Vec<M> = (0..n).map(|_| upper(1)).collect();
        let corner: Vec<M> = (0..n).map(|_| upper(1)).collect();
        let rad = corner.iter().map(M::abs).collect();
        let h = mid.iter().zip(&corner).map(|(m, c)| m.add(c)).collect();
        let l = draw.matrix(n, m, 1);
        Self { h, mid, rad, l }
    }

    /// The same function with its half Hessian known.
    fn known(self) -> Self {
        let rad = self
            .h
            .iter()
            .map(|h| M::zeros(h.rows(), h.cols()))
            .collect();
        Self {
            mid: self.h.clone(),
            rad,
            ..self
        }
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
fn taylor(f: &Function, z: &Cz, h: &[Q], symmetric: bool, terms: Terms) -> Cz {
    let (n, m, mg) = (f.h.len(), z.c.len(), z.g.cols());
    let p = sub(&z.c, h);
    let half = frac(1, 2);
    let mut center = Vec::new();
    let mut rows = Vec::new();
    let mut widths = Vec::new();
    let (mut mid, mut rad) = (Vec::new(), Vec::new());
    let mut pairs: Vec<(usize, usize)> = (0..mg)
        .flat_map(|i| (i + 1..mg).map(move |j| (i, j)))
        .collect();
    if terms == Terms::Reversed {
        pairs.reverse();
    }
    let absolute: V = p.iter().map(Signed::abs).collect();
    for (h, r) in f.mid.iter().zip(&f.rad) {
        let q_mid = z.g.t().mul(h).mul(&z.g);
        let q_rad = z.g.abs().t().mul(r).mul(&z.g.abs());
        center.push(q_mid.trace() * &half);
        let mut row: V = (0..mg).map(|i| &q_mid[(i, i)] * &half).collect();
        let mut mixed: V = pairs
            .iter()
            .map(|&(i, j)| &q_mid[(i, j)] + &q_mid[(j, i)])
            .collect();
        if terms == Terms::ReversedHalf {
            mixed.reverse();
        }
        row.extend(mixed);
        rows.push(row);
        let spread = q_rad.row_sums().iter().fold(Q::zero(), |s, w| s + w);
        widths.push(if terms == Terms::WithoutDiagonal {
            Q::zero()
        } else {
            spread
        });
        let (h, r) = if symmetric {
            (h.add(&h.t()).scale(&half), r.add(&r.t()).scale(&half))
        } else {
            (h.clone(), r.clone())
        };
        mid.push(h.t().apply(&p));
        let spread = r.t().apply(&absolute);
        rad.push(if terms == Terms::WithoutRadius {
            vec![Q::zero(); m]
        } else {
            spread
        });
    }
    let columns = mg + pairs.len();
    let mut constraints = Vec::new();
    let mut right = Vec::new();
    let mut products: Vec<(usize, usize)> = (0..z.a.rows())
        .flat_map(|r| (r..z.a.rows()).map(move |s| (r, s)))
        .filter(|(r, s)| terms != Terms::WithoutSquares || r != s)
        .collect();
    if terms == Terms::Reversed {
        products.reverse();
    }
    for (r, s) in products {
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
    let remainder = Cz {
        g: M::of_rows(columns, &rows),
        c: center,
        a: M::of_rows(columns, &constraints),
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
        mid: vec![M::ints(&[&[0, 1], &[0, 0]])],
        rad: vec![M::zeros(2, 2)],
        l: M::zeros(1, 2),
    };
    (f, Cz::boxed(vec![q(0), q(1)], &[q(1), q(1)]))
}

fn enclosure(t: &mut Trial, terms: Terms) {
    let (f, z) = product();
    let h = vec![q(0), q(0)];
    let hull = taylor(&f, &z, &h, false, Terms::All)
        .hull()
        .unwrap_or_default();
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
        let (z, f) = match k % 4 {
            0 => (
                t.draw.cz(m, 2 + constraints, constraints),
                Function::drawn(&mut t.draw, n, m),
            ),
            // A box and a known constant Hessian: the remainder has no slack to hide the error.
            1 | 3 => (
                Cz::boxed(t.draw.vector(m, 2), &[q(1), q(1)]),
                Function::drawn(&mut t.draw, 1, m).known(),
            ),
            _ => (
                Cz::boxed(t.draw.vector(m, 2), &[q(1), q(1)]),
                Function::drawn(&mut t.draw, 1, m),
            ),
        };
        let mut points = z.points(&mut t.draw, 5);
        let Some(h) = points.last().cloned() else {
            continue;
        };
        if h == z.c {
            continue;
        }
        // Points between those and h.
        let inner: Vec<V> = points
            .iter()
            .map(|x| scale(&frac(1, 2), &add(x, &h)))
            .collect();
        points.extend(inner);
        let printed = taylor(&f, &z, &h, false, Terms::All);
        let symmetric = taylor(&f, &z, &h, true, terms);
        for x in &points {
            let y = f.at(x);
            t.check(printed.contains(&y));
            t.repaired(symmetric.contains(&y));
        }
    }
}

fn centred(t: &mut Trial, terms: Terms) {
    for _ in 0..120 {
        let n = t.draw.size(1, 2);
        let constraints = t.draw.size(0, 1);
        let mut z = t.draw.cz(2, 2 + constraints, constraints);
        // ξ = 0 satisfies the constraints, so that the centre lies in the set.
        z.b = vec![Q::zero(); constraints];
        let f = Function::drawn(&mut t.draw, n, 2);
        let set = taylor(&f, &z, &z.c, false, terms);
        for x in z.points(&mut t.draw, 5) {
            let half = scale(&frac(1, 2), &add(&x, &z.c));
            t.check(set.contains(&f.at(&x)));
            t.check(set.contains(&f.at(&half)));
        }
        let last = set.g.cols() - n..set.g.cols();
        t.check(last.clone().all(|j| set.g.col(j).iter().all(Zero::is_zero)));
    }
}

fn order_of_indices(t: &mut Trial, damaged: bool) {
    for _ in 0..60 {
        let n = t.draw.size(1, 2);
        let constraints = t.draw.size(1, 2);
        let z = t.draw.cz(2, 3 + constraints, constraints);
        let f = Function::drawn(&mut t.draw, n, 2);
        let Some(h) = z.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let terms = if damaged {
            Terms::ReversedHalf
        } else {
            Terms::Reversed
        };
        let d = t.draw.direction(n, 3);
        let one = taylor(&f, &z, &h, true, Terms::All).support(&d);
        t.check(one == taylor(&f, &z, &h, true, terms).support(&d));
    }
}

/// H(z) = H₀ + Σ z_k H_k of a cubic η, over the hull of Z.
fn interval_bounds(t: &mut Trial, damaged: bool) {
    for _ in 0..120 {
        let constraints = t.draw.size(0, 1);
        let z = t.draw.cz(2, 2 + constraints, constraints);
        let Some(hull) = z.hull() else { continue };
        let parts: Vec<M> = (0..3)
            .map(|_| M::from_fn(2, 2, |i, j| q(if i <= j { t.draw.int(-2, 2) } else { 0 })))
            .collect();
        let at = |x: &[Q]| {
            let first = parts[0].add(&parts[1].scale(&x[0]));
            first.add(&parts[2].scale(&x[1]))
        };
        let middle: V = hull.iter().map(|(l, h)| (l + h) / q(2)).collect();
        let share = q(if damaged { 4 } else { 2 });
        let half: V = hull.iter().map(|(l, h)| (h - l) / &share).collect();
        let bound = Intervals {
            mid: at(&middle),
            rad: parts[1]
                .abs()
                .scale(&half[0])
                .add(&parts[2].abs().scale(&half[1])),
        };
        let within = |x: &M, mid: &M, rad: &M| {
            let d = x.sub(mid).abs();
            (0..d.rows()).all(|i| (0..d.cols()).all(|j| d[(i, j)] <= rad[(i, j)]))
        };
        let gt = z.g.t();
        let turned = (
            gt.mul(&bound.mid).mul(&z.g),
            gt.abs().mul(&bound.rad).mul(&z.g.abs()),
        );
        let points = z.points(&mut t.draw, 5);
        let Some(h) = points.last() else { continue };
        let p = M::of_rows(2, &[sub(&z.c, h)]);
        let row = (p.mul(&bound.mid), p.abs().mul(&bound.rad));
        for x in &points {
            let g = at(x);
            t.check(within(&g, &bound.mid, &bound.rad));
            t.check(within(&gt.mul(&g).mul(&z.g), &turned.0, &turned.1));
            t.check(within(&p.mul(&g), &row.0, &row.1));
        }
    }
}

fn size(t: &mut Trial, terms: Terms) {
    for _ in 0..60 {
        let (n, m) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let constraints = t.draw.size(0, 3);
        let z = t.draw.cz(m, m + constraints, constraints);
        let f = Function::drawn(&mut t.draw, n, m);
        let set = taylor(&f, &z, &scale(&q(1), &z.c), true, terms);
        let (mg, mc) = (z.g.cols(), z.a.rows());
        t.check(2 * set.g.cols() == mg * mg + 5 * mg + 4 * n);
        t.check(2 * set.a.rows() == mc * mc + 5 * mc);
    }
}

/// Generators after `steps` first-order predictions of n states from m generators.
fn generators(m: i64, n: i64, steps: usize) -> i64 {
    (0..steps).fold(m, |m, _| (m * m + 5 * m) / 2 + 2 * n)
}

/// The claim of one to three steps, and of `repaired` alone.
fn growth(t: &mut Trial, repaired: usize) {
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
                if steps == repaired {
                    t.repaired(quadratic);
                }
            }
        }
    }
}
