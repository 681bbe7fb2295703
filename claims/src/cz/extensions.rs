//! Section 4.1: the inclusion of an interval matrix times a constrained zonotope, and the mean value extension.

use super::claim;
use crate::exact::{Cz, M, Q, Source, V, add, dot, q, scale, sub};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-1",
            "J X is contained in mid(J) X + P B, P by (12)",
            "",
            |t| inclusion(t, Damage::None),
        )
        .twin("diam(m)/2 left out of (12)", |t| {
            inclusion(t, Damage::Center);
        })
        .twin("P halved", |t| inclusion(t, Damage::Half)),
        claim(
            "remark-3",
            "(13) has n_g + n generators and n_c constraints",
            "",
            |t| inclusion_size(t, false),
        )
        .twin("X without its constraints", |t| inclusion_size(t, true)),
        claim(
            "theorem-2",
            "mu(X, W) is contained in Z + (J, X - h) for h in X",
            "",
            |t| mean_value(t, Damage::None),
        )
        .twin("diam(m)/2 left out of (12)", |t| {
            mean_value(t, Damage::Center);
        })
        .twin("P halved", |t| mean_value(t, Damage::Half)),
        claim(
            "remark-4",
            "mu(h, W) is exactly beta(h) + B_w(h) W if mu is affine in w, and contained in mu(h, h_w) + (J_w, W - h_w)",
            "",
            |t| noise_sets(t, false),
        )
        .twin("W without its constraints, P halved", |t| noise_sets(t, true)),
        claim(
            "remark-5",
            "Theorem 2 gives at most n_g + n_gw + 2n generators and n_c + n_cw constraints",
            "",
            |t| mean_value_size(t, false),
        )
        .twin("the constraints of W left out", |t| {
            mean_value_size(t, true);
        }),
    ]
}

/// What a damaged twin loses of (12).
#[derive(Clone, Copy, PartialEq)]
pub enum Damage {
    None,
    /// ½ diam(m).
    Center,
    /// Half of P.
    Half,
}

/// An interval matrix by midpoint and radius.
pub struct Intervals {
    pub mid: M,
    pub rad: M,
}

impl Intervals {
    pub fn drawn(draw: &mut Source, rows: usize, cols: usize) -> Self {
        let mid = draw.matrix(rows, cols, 2);
        let rad = draw.matrix(rows, cols, 1).abs();
        Self { mid, rad }
    }
}

/// mid(J) X ⊕ P B with P of (12) for the zonotope `outer` ⊇ X.
pub fn inclusion_of(j: &Intervals, x: &Cz, outer: &Cz) -> Cz {
    inclusion_by(j, x, outer, Damage::None)
}

/// The same with a damaged P.
pub fn inclusion_by(j: &Intervals, x: &Cz, outer: &Cz, damage: Damage) -> Cz {
    let mut p = j.rad.mul(&outer.g.abs()).row_sums();
    if damage != Damage::Center {
        let center: V = outer.c.iter().map(Signed::abs).collect();
        p = add(&p, &j.rad.apply(&center));
    }
    if damage == Damage::Half {
        p = p.iter().map(|p| p / q(2)).collect();
    }
    let n = p.len();
    x.image(&j.mid).sum(&Cz::boxed(vec![Q::zero(); n], &p))
}

/// A matrix of J at one of its corners: in half of the draws the one in which every row's radius adds up over `d`.
pub fn slope_in(j: &Intervals, d: &[Q], draw: &mut Source) -> M {
    let along = draw.int(0, 1) == 0;
    let rows: V = (0..j.mid.rows()).map(|_| draw.sign()).collect();
    M::from_fn(j.mid.rows(), j.mid.cols(), |i, k| {
        let sign = if along {
            let down = d[k].is_negative();
            if down {
                -rows[i].clone()
            } else {
                rows[i].clone()
            }
        } else {
            draw.sign()
        };
        &j.mid[(i, k)] + sign * &j.rad[(i, k)]
    })
}

/// One constraint is solved for its largest entry and inserted, until none is left: (17) without rescaling.
pub fn eliminated(z: &Cz) -> Cz {
    let mut z = z.clone();
    while z.a.rows() > 0 {
        let (rows, cols) = (z.a.rows(), z.a.cols());
        let pivot = (0..rows)
            .flat_map(|i| (0..cols).map(move |j| (i, j)))
            .filter(|&at| !z.a[at].is_zero())
            .min_by_key(|&(i, j)| (std::cmp::Reverse(z.a[(i, j)].abs()), i, j));
        let Some((i, j)) = pivot else {
            // Rows of zeros say nothing.
            return z.relaxed();
        };
        let value = z.a[(i, j)].clone();
        let column = |m: &M| scale(&value.recip(), &m.col(j));
        let (row, b) = (z.a.row(i).to_vec(), z.b[i].clone());
        let reduce = |m: &M, rows: &[usize]| {
            let factor = column(m);
            M::from_fn(rows.len(), cols - 1, |r, c| {
                let c = if c < j { c } else { c + 1 };
                &m[(rows[r], c)] - &factor[rows[r]] * &row[c]
            })
        };
        let all: Vec<usize> = (0..z.g.rows()).collect();
        let others: Vec<usize> = (0..rows).filter(|&r| r != i).collect();
        let g = reduce(&z.g, &all);
        let a = reduce(&z.a, &others);
        let c = add(&z.c, &scale(&b, &column(&z.g)));
        let factor = column(&z.a);
        let b = others.iter().map(|&r| &z.b[r] - &factor[r] * &b).collect();
        z = Cz { g, c, a, b };
    }
    z
}

fn drawn_set(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(0, 1);
    let generators = draw.size(n, n + 1) + constraints;
    draw.cz(n, generators, constraints)
}

pub fn inclusion(t: &mut Trial, damage: Damage) {
    for k in 0..100 {
        let (n, m) = (t.draw.size(1, 2), t.draw.size(1, 2));
        let x = drawn_set(&mut t.draw, m);
        let j = Intervals::drawn(&mut t.draw, n, m);
        let outer = if k % 2 == 0 {
            x.relaxed()
        } else {
            eliminated(&x)
        };
        let set = inclusion_by(&j, &x, &outer, damage);
        let d = t.draw.direction(n, 3);
        let Some(support) = set.support(&d) else {
            t.check(false);
            continue;
        };
        for x in x.points(&mut t.draw, 4) {
            // The largest d·Ĵx over Ĵ ∈ J.
            let spread = j.rad.apply(&x.iter().map(Signed::abs).collect::<V>());
            let weight: V = d.iter().map(Signed::abs).collect();
            let value = dot(&d, &j.mid.apply(&x)) + dot(&weight, &spread);
            t.check(value <= support);
        }
    }
}

fn inclusion_size(t: &mut Trial, damaged: bool) {
    for _ in 0..200 {
        let (n, m) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let x = drawn_set(&mut t.draw, m);
        let j = Intervals::drawn(&mut t.draw, n, m);
        let kept = if damaged { x.relaxed() } else { x.clone() };
        let set = inclusion_of(&j, &kept, &eliminated(&x));
        t.check(set.g.cols() == x.g.cols() + n && set.a.rows() == x.a.rows());
    }
}

/// μᵢ(x, w) = xᵀ Qᵢ x + lᵢ·x + (B w)ᵢ.
pub struct Quadratic {
    pub q: Vec<M>,
    pub l: M,
    pub b: M,
}

impl Quadratic {
    pub fn drawn(draw: &mut Source, n: usize, w: usize) -> Self {
        Self {
            q: (0..n).map(|_| draw.matrix(n, n, 1)).collect(),
            l: draw.matrix(n, n, 2),
            b: draw.matrix(n, w, 1),
        }
    }

    pub fn at(&self, x: &[Q], w: &[Q]) -> V {
        let square: V = self.q.iter().map(|q| dot(x, &q.apply(x))).collect();
        add(&add(&square, &self.l.apply(x)), &self.b.apply(w))
    }

    /// The exact range of the gradient over a box.
    pub fn gradient(&self, hull: &[(Q, Q)]) -> Intervals {
        let two = q(2);
        let mid: V = hull.iter().map(|(l, h)| (l + h) / &two).collect();
        let rad: V = hull.iter().map(|(l, h)| (h - l) / &two).collect();
        let n = mid.len();
        let symmetric: Vec<M> = self.q.iter().map(|q| q.add(&q.t())).collect();
        Intervals {
            mid: M::from_fn(n, n, |i, k| {
                dot(symmetric[i].row(k), &mid) + &self.l[(i, k)]
            }),
            rad: M::from_fn(n, n, |i, k| dot(symmetric[i].abs().row(k), &rad)),
        }
    }
}

/// μ = S(w) x + b w², S(w) = mid + w (S − mid) for the corner S of J, over W = [−1, 1]: not affine in w, and its
/// gradient fills J. With a fixed slope and b = 0 it is S x, for which P has no slack.
struct Bilinear {
    j: Intervals,
    slope: M,
    square: V,
    fixed: bool,
}

impl Bilinear {
    fn at(&self, x: &[Q], w: &Q) -> V {
        if self.fixed {
            return self.slope.apply(x);
        }
        let part = self.slope.sub(&self.j.mid).scale(w);
        let moved = self.j.mid.add(&part).apply(x);
        add(&moved, &scale(&(w * w), &self.square))
    }

    /// A zonotope that holds μ(h, W): w and w² vary on their own.
    fn noise_image(&self, h: &[Q]) -> Cz {
        let zero = Q::zero();
        let half = scale(&(q(1) / q(2)), &self.square);
        if self.fixed {
            return Cz::boxed(self.at(h, &zero), &vec![zero; h.len()]);
        }
        let first = self.slope.sub(&self.j.mid).apply(h);
        let g = M::from_fn(h.len(), 2, |i, j| {
            if j == 0 {
                first[i].clone()
            } else {
                half[i].clone()
            }
        });
        Cz::zonotope(g, add(&self.at(h, &zero), &half))
    }
}

pub fn mean_value(t: &mut Trial, damage: Damage) {
    for k in 0..160 {
        let n = t.draw.size(1, 2);
        let x = drawn_set(&mut t.draw, n);
        let points = x.points(&mut t.draw, 5);
        let (Some(h), Some(far)) = (points.last(), points.first()) else {
            continue;
        };
        let j = Intervals::drawn(&mut t.draw, n, n);
        let slope = slope_in(&j, &sub(far, h), &mut t.draw);
        let f = Bilinear {
            j,
            slope,
            square: t.draw.vector(n, 1),
            fixed: k % 2 == 0,
        };
        let moved = x.about(h);
        let own = inclusion_by(&f.j, &moved, &eliminated(&moved), damage);
        let set = f.noise_image(h).sum(&own);
        for x in &points {
            let w = t.draw.unit();
            t.check(set.contains(&f.at(x, &w)));
        }
    }
}

fn noise_sets(t: &mut Trial, damaged: bool) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let w = drawn_set(&mut t.draw, 2);
        let f = Quadratic::drawn(&mut t.draw, n, 2);
        let h = t.draw.vector(n, 2);
        let used = if damaged { w.relaxed() } else { w.clone() };
        let mut z = used.image(&f.b);
        z.c = add(&z.c, &f.at(&h, &vec![Q::zero(); 2]));
        let d = t.draw.direction(n, 3);
        // By the definition of the image: the largest d·μ(h, w) over w.
        let truth = w
            .support(&f.b.t().apply(&d))
            .map(|s| s + dot(&d, &f.at(&h, &vec![Q::zero(); 2])));
        t.check(z.support(&d) == truth);
        // The other alternative, for a function of w with a slope at a corner of J_w.
        let points = w.points(&mut t.draw, 3);
        let (Some(center), Some(far)) = (points.last(), points.first()) else {
            continue;
        };
        let j = Intervals::drawn(&mut t.draw, n, 2);
        let slope = slope_in(&j, &sub(far, center), &mut t.draw);
        let moved = w.about(center);
        let damage = if damaged { Damage::Half } else { Damage::None };
        let mut set = inclusion_by(&j, &moved, &eliminated(&moved), damage);
        set.c = add(&set.c, &slope.apply(center));
        for w in &points {
            t.check(set.contains(&slope.apply(w)));
        }
    }
}

/// Z ⊕ ⊲(J, X − h) with the affine Z of Remark 4.
fn extension(f: &Quadratic, x: &Cz, w: &Cz, h: &[Q]) -> Option<Cz> {
    let j = f.gradient(&x.hull()?);
    let mut z = w.image(&f.b);
    z.c = add(&z.c, &f.at(h, &vec![Q::zero(); w.c.len()]));
    let moved = x.about(h);
    Some(z.sum(&inclusion_of(&j, &moved, &eliminated(&moved))))
}

fn mean_value_size(t: &mut Trial, damaged: bool) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let (x, w) = (drawn_set(&mut t.draw, n), drawn_set(&mut t.draw, 2));
        let f = Quadratic::drawn(&mut t.draw, n, 2);
        let Some(h) = x.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let kept = if damaged { w.relaxed() } else { w.clone() };
        let Some(affine) = extension(&f, &x, &kept, &h) else {
            continue;
        };
        // The other alternative of Remark 4: one more inclusion, in w.
        let Some(center) = w.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let jw = Intervals::drawn(&mut t.draw, n, 2);
        let moved = w.about(&center);
        let z = inclusion_of(&jw, &moved, &eliminated(&moved));
        let moved = x.about(&h);
        let general = z.sum(&inclusion_of(
            &Intervals::drawn(&mut t.draw, n, n),
            &moved,
            &eliminated(&moved),
        ));
        for set in [affine, general] {
            t.check(
                set.g.cols() <= x.g.cols() + w.g.cols() + 2 * n
                    && set.a.rows() == x.a.rows() + w.a.rows(),
            );
        }
    }
}
