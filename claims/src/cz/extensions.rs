//! Section 4.1: the inclusion of an interval matrix times a constrained zonotope, and the mean value extension.

use super::claim;
use crate::exact::{Cz, M, Q, Source, V, add, dot, q, scale};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "theorem-1",
            "J X is contained in mid(J) X + P B, P by (12)",
            "",
            inclusion,
        ),
        claim(
            "remark-3",
            "(13) has n_g + n generators and n_c constraints",
            "",
            inclusion_size,
        ),
        claim(
            "theorem-2",
            "mu(X, W) is contained in Z + (J, X - h) for h in X (with the affine Z of Remark 4)",
            "",
            mean_value,
        ),
        claim(
            "remark-4",
            "if mu is affine in w, then mu(h, W) is exactly beta(h) + B_w(h) W",
            "",
            affine_noise,
        ),
        claim(
            "remark-5",
            "Theorem 2 gives at most n_g + n_gw + 2n generators and n_c + n_cw constraints",
            "",
            mean_value_size,
        ),
    ]
}

/// An interval matrix by midpoint and radius.
pub struct Intervals {
    pub mid: M,
    pub rad: M,
}

impl Intervals {
    fn drawn(draw: &mut Source, rows: usize, cols: usize) -> Self {
        let mid = draw.matrix(rows, cols, 2);
        let rad = draw.matrix(rows, cols, 1).abs();
        Self { mid, rad }
    }
}

/// mid(J) X ⊕ P B with P of (12) for the zonotope `outer` ⊇ X.
pub fn inclusion_of(j: &Intervals, x: &Cz, outer: &Cz) -> Cz {
    let p = add(
        &j.rad.apply(&outer.c.iter().map(Signed::abs).collect::<V>()),
        &j.rad.mul(&outer.g.abs()).row_sums(),
    );
    let n = p.len();
    x.image(&j.mid).sum(&Cz::boxed(vec![Q::zero(); n], &p))
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

pub fn inclusion(t: &mut Trial) {
    for k in 0..100 {
        let (n, m) = (t.draw.size(1, 2), t.draw.size(1, 2));
        let x = drawn_set(&mut t.draw, m);
        let j = Intervals::drawn(&mut t.draw, n, m);
        let outer = if k % 2 == 0 {
            x.relaxed()
        } else {
            eliminated(&x)
        };
        let set = inclusion_of(&j, &x, &outer);
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

fn inclusion_size(t: &mut Trial) {
    for _ in 0..200 {
        let (n, m) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let x = drawn_set(&mut t.draw, m);
        let j = Intervals::drawn(&mut t.draw, n, m);
        let set = inclusion_of(&j, &x, &eliminated(&x));
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

fn extension(f: &Quadratic, x: &Cz, w: &Cz, h: &[Q]) -> Option<Cz> {
    let j = f.gradient(&x.hull()?);
    let mut z = w.image(&f.b);
    z.c = add(&z.c, &f.at(h, &vec![Q::zero(); w.c.len()]));
    let moved = x.about(h);
    Some(z.sum(&inclusion_of(&j, &moved, &eliminated(&moved))))
}

pub fn mean_value(t: &mut Trial) {
    for _ in 0..60 {
        let n = t.draw.size(1, 2);
        let (x, w) = (drawn_set(&mut t.draw, n), drawn_set(&mut t.draw, 1));
        let f = Quadratic::drawn(&mut t.draw, n, 1);
        let points = x.points(&mut t.draw, 4);
        let noise = w.points(&mut t.draw, 4);
        let Some(h) = points.last() else { continue };
        let Some(set) = extension(&f, &x, &w, h) else {
            t.check(false);
            continue;
        };
        for (x, w) in points.iter().zip(&noise) {
            t.check(set.contains(&f.at(x, w)));
        }
    }
}

fn affine_noise(t: &mut Trial) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let w = drawn_set(&mut t.draw, 2);
        let f = Quadratic::drawn(&mut t.draw, n, 2);
        let h = t.draw.vector(n, 2);
        let mut z = w.image(&f.b);
        z.c = add(&z.c, &f.at(&h, &vec![Q::zero(); 2]));
        let d = t.draw.direction(n, 3);
        // By the definition of the image: the largest d·μ(h, w) over w.
        let truth = w
            .support(&f.b.t().apply(&d))
            .map(|s| s + dot(&d, &f.at(&h, &vec![Q::zero(); 2])));
        t.check(z.support(&d) == truth);
    }
}

fn mean_value_size(t: &mut Trial) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let (x, w) = (drawn_set(&mut t.draw, n), drawn_set(&mut t.draw, 2));
        let f = Quadratic::drawn(&mut t.draw, n, 2);
        let Some(h) = x.points(&mut t.draw, 1).pop() else {
            continue;
        };
        let Some(affine) = extension(&f, &x, &w, &h) else {
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
