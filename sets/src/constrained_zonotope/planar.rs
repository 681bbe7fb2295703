//! Vertices and area in the plane, by a sweep of supports that ends when every edge is confirmed.
//!
//! The polygon grows from the extreme points along the axes: the outward normal of an edge is a
//! direction to maximise, and either finds a vertex beyond the edge or shows that it is one. So there are
//! about two programs a vertex, and no direction is missed unless there are more than 4096 vertices.

use super::ConstrainedZonotope;
use super::same;
use crate::SetError;
use crate::lp::LinearProgram;

/// Points closer than this times the size of the set are the same vertex.
pub(super) const NEAR: f64 = 1e-10;

/// A sweep that has found this many vertices ends with them.
const MOST_VERTICES: usize = 4096;

impl ConstrainedZonotope {
    /// The vertices of a set of the plane, counter-clockwise from the lowest; a segment has 2, a point 1.
    ///
    /// Rounded to nearest: vertices are for drawing and measuring, not a bound; r and δ do not enter.
    /// Fails with `Dimension` unless n = 2, with `Empty` if the set is proved empty.
    pub fn vertices(&self) -> Result<Vec<[f64; 2]>, SetError> {
        same("vertices", 2, self.dim())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        let mut polygon: Vec<[f64; 2]> = Vec::new();
        let hull = self.z.radius();
        let near = NEAR * (hull[0] + hull[1]);
        for d in [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]] {
            let v = self.extreme_point(&d, &mut lp)?;
            if polygon.iter().all(|p| distance(*p, [v[0], v[1]]) > near) {
                polygon.push([v[0], v[1]]);
            }
        }
        if polygon.len() == 1 {
            return Ok(polygon);
        }
        // Every edge is either confirmed or split in two, and a split adds a vertex beyond `near`. Extreme points
        // are rounded and need not be quite extreme, so that alone does not end it.
        let mut edge = 0;
        while edge < polygon.len() && polygon.len() < MOST_VERTICES {
            let (p, q) = (polygon[edge], polygon[(edge + 1) % polygon.len()]);
            let length = distance(p, q);
            let normal = [(q[1] - p[1]) / length, (p[0] - q[0]) / length];
            let v = self.extreme_point(&normal, &mut lp)?;
            let beyond = normal[0] * (v[0] - p[0]) + normal[1] * (v[1] - p[1]);
            if beyond > near {
                polygon.insert(edge + 1, [v[0], v[1]]);
            } else {
                edge += 1;
            }
        }
        Ok(without_straight_corners(polygon, near))
    }

    /// A point of ⟨c, G, A, b⟩ where dᵀx is greatest, rounded to nearest; r and δ do not enter.
    ///
    /// Fails with `Dimension`, `NotFinite`, or `Empty` if the set is proved empty.
    pub fn support_vector(&self, d: &[f64]) -> Result<Vec<f64>, SetError> {
        same("support vector", self.dim(), d.len())?;
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        self.extreme_point(d, &mut lp)
    }

    /// The support vector, the constraints being in `lp` already.
    pub(super) fn extreme_point(
        &self,
        d: &[f64],
        lp: &mut LinearProgram,
    ) -> Result<Vec<f64>, SetError> {
        let mut along = vec![0.0; self.generators()];
        for (i, &d) in d.iter().enumerate() {
            for (t, &g) in along.iter_mut().zip(self.g().row(i)) {
                *t += d * g;
            }
        }
        super::empty_in(
            "extreme point of a constrained zonotope",
            lp.maximize(&along),
        )?;
        let offset = self.g().mul_vec(lp.point());
        Ok(self.c().iter().zip(offset).map(|(c, o)| c + o).collect())
    }

    /// The area by the shoelace formula over the vertices.
    pub(super) fn area(&self) -> Result<f64, SetError> {
        let v = self.vertices()?;
        let o = v[0];
        let corner = |p: [f64; 2]| [p[0] - o[0], p[1] - o[1]];
        let pairs = v.windows(2).map(|w| (corner(w[0]), corner(w[1])));
        Ok(pairs
            .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
            .sum::<f64>()
            .max(0.0))
    }
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
}

/// The polygon without vertices that lie within `near` of the line through their neighbours: extreme
/// points along the axes may lie inside an edge.
fn without_straight_corners(polygon: Vec<[f64; 2]>, near: f64) -> Vec<[f64; 2]> {
    let mut kept = polygon;
    let mut i = 0;
    while kept.len() > 2 && i < kept.len() {
        let (p, v, q) = (
            kept[(i + kept.len() - 1) % kept.len()],
            kept[i],
            kept[(i + 1) % kept.len()],
        );
        let area = (v[0] - p[0]) * (q[1] - p[1]) - (v[1] - p[1]) * (q[0] - p[0]);
        if area.abs() <= near * distance(p, q) {
            kept.remove(i);
        } else {
            i += 1;
        }
    }
    kept
}
