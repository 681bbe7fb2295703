//! A box of the plane or of space from which half-spaces cut off one after the other, in f64.
//!
//! A sweep asks programs where the vertices are, and goes astray where facets are so nearly parallel that their
//! vertices are rounding. Cutting a box by one plane at a time needs no programs and always ends, with
//! vertices that are off by rounding at worst: enough to choose by and to draw, no proof of anything.

use super::Slab;
use crate::IntervalVector;

type Point = [f64; 3];

/// Points closer than this, in a box of half-width 1, are one vertex.
const SAME_POINT: f64 = 1e-10;

/// A convex body in the coordinates of its box, which is [−1, 1]ⁿ; each face by its corners in their order. In the
/// plane there is one face.
#[derive(Clone, Debug)]
pub(super) struct Clipped {
    faces: Vec<Vec<Point>>,
    center: Vec<f64>,
    radius: Vec<f64>,
}

/// A slab in those coordinates: aᵀx in [lo, hi].
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    a: Point,
    lo: f64,
    hi: f64,
}

impl Clipped {
    /// The box, of two or three dimensions.
    pub fn of_box(hull: &IntervalVector) -> Self {
        let radius = hull.rad().into_vec();
        let side = |j: usize| if radius[j] > 0.0 { 1.0 } else { 0.0 };
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let faces = if hull.dim() == 2 {
            vec![
                square
                    .map(|[s, t]| [s * side(0), t * side(1), 0.0])
                    .to_vec(),
            ]
        } else {
            let face = |axis: usize, end: f64| {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |[s, t]: [f64; 2]| {
                    let mut x = [0.0; 3];
                    (x[axis], x[j], x[k]) = (end * side(axis), s * side(j), t * side(k));
                    x
                };
                square.map(corner).to_vec()
            };
            (0..6)
                .map(|i| face(i / 2, if i % 2 == 0 { 1.0 } else { -1.0 }))
                .collect()
        };
        Self {
            faces,
            center: hull.mid().into_vec(),
            radius,
        }
    }

    /// The slab in the body's coordinates.
    pub fn cut_of(&self, slab: &Slab) -> Cut {
        let mut a = [0.0; 3];
        let mut at_center = 0.0;
        for (j, (&normal, c)) in slab.normal.iter().zip(&self.center).enumerate() {
            a[j] = normal * self.radius[j];
            at_center += normal * c;
        }
        Cut {
            a,
            lo: slab.range.lo() - at_center,
            hi: slab.range.hi() - at_center,
        }
    }

    /// By how much the slab cuts into the body, at the side where it cuts more, as a share of the box's width.
    pub fn depth(&self, cut: &Cut) -> f64 {
        let whole = cut.a.iter().map(|a| a.abs()).sum::<f64>();
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in self.faces.iter().flatten() {
            let value = dot(cut.a, *x);
            lo = lo.min(value);
            hi = hi.max(value);
        }
        (hi - cut.hi).max(cut.lo - lo) / (2.0 * whole)
    }

    /// Cuts off what is outside of the slab.
    pub fn cut(&mut self, cut: &Cut) {
        self.keep_below(cut.a, cut.hi);
        self.keep_below(cut.a.map(|a| -a), -cut.lo);
    }

    /// Keeps aᵀx ≤ o.
    fn keep_below(&mut self, a: Point, o: f64) {
        let over = |x: &Point| dot(a, *x) - o;
        if self.faces.iter().flatten().all(|x| over(x) <= 0.0) {
            return;
        }
        let mut rim: Vec<Point> = Vec::new();
        for face in &mut self.faces {
            let mut kept = Vec::with_capacity(face.len() + 1);
            for (i, x) in face.iter().enumerate() {
                let y = &face[(i + 1) % face.len()];
                let (p, q) = (over(x), over(y));
                if p <= 0.0 {
                    kept.push(*x);
                }
                if (p < 0.0 && q > 0.0) || (p > 0.0 && q < 0.0) {
                    let t = p / (p - q);
                    let between = [0, 1, 2].map(|j| x[j] + t * (y[j] - x[j]));
                    kept.push(between);
                    rim.push(between);
                } else if p == 0.0 {
                    rim.push(*x);
                }
            }
            *face = kept;
        }
        self.faces.retain(|face| face.len() > 2);
        if self.center.len() == 3 {
            let rim = around(a, distinct(rim));
            if rim.len() > 2 {
                self.faces.push(rim);
            }
        }
    }

    /// The vertices in the coordinates of the set, in the plane in their order.
    pub fn vertices(&self) -> Vec<Vec<f64>> {
        let all = distinct(self.faces.iter().flatten().copied().collect());
        let back = |x: Point| {
            let own = self.center.iter().zip(&self.radius).zip(x);
            own.map(|((c, r), x)| c + r * x).collect()
        };
        all.into_iter().map(back).collect()
    }

    /// Area or volume.
    pub fn volume(&self) -> f64 {
        let scale: f64 = self.radius.iter().product();
        let planar = self.center.len() == 2;
        let inside = self.faces.first().and_then(|f| f.first().copied());
        let Some(o) = inside else { return 0.0 };
        let mut sum = 0.0;
        for face in &self.faces {
            let first = minus(face[0], o);
            for pair in face[1..].windows(2) {
                let (b, c) = (minus(pair[0], o), minus(pair[1], o));
                sum += if planar {
                    (0.5 * (b[0] * c[1] - b[1] * c[0])).abs()
                } else {
                    (dot(first, super::spatial::cross(b, c)) / 6.0).abs()
                };
            }
        }
        sum * scale
    }
}

/// The points without those that are there already.
fn distinct(points: Vec<Point>) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for x in points {
        let known = |y: &Point| {
            let apart = minus(x, *y);
            dot(apart, apart) <= SAME_POINT * SAME_POINT
        };
        if !kept.iter().any(known) {
            kept.push(x);
        }
    }
    kept
}

/// The points of a plane with normal `a`, in their order around their middle.
fn around(a: Point, points: Vec<Point>) -> Vec<Point> {
    let size = dot(a, a).sqrt();
    let a = a.map(|x| x / size);
    let least = (0..3).fold(0, |m, j| if a[j].abs() < a[m].abs() { j } else { m });
    let mut e = [0.0; 3];
    e[least] = 1.0;
    let (u, count) = (super::spatial::cross(a, e), points.len() as f64);
    let v = super::spatial::cross(a, u);
    let middle = [0, 1, 2].map(|j| points.iter().map(|x| x[j]).sum::<f64>() / count);
    let mut turned: Vec<(f64, Point)> = points
        .into_iter()
        .map(|x| {
            let from = minus(x, middle);
            (libm::atan2(dot(from, v), dot(from, u)), x)
        })
        .collect();
    turned.sort_by(|x, y| x.0.total_cmp(&y.0));
    turned.into_iter().map(|(_, x)| x).collect()
}

fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|j| a[j] - b[j])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
