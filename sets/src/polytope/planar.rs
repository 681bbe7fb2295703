//! The vertices and edges of a convex set of the plane, by a sweep of supports that ends when every edge
//! is confirmed.
//!
//! The polygon grows from the extreme points along the axes: the outward normal of an edge is a
//! direction to maximise, and either finds a vertex beyond the edge or shows that it is one. So there are
//! about two programs a vertex, and no direction is missed.

use crate::SetError;

pub(crate) type Point = [f64; 2];

/// What is known of one direction: an upper bound on the support, and a point where it is attained up to
/// rounding.
pub(crate) type Extreme2 = (f64, Point);

/// A polygon by its vertices, counter-clockwise from the lowest, and the confirmed half-planes.
pub(crate) struct Polygon {
    pub points: Vec<Point>,
    /// Unit normals with the upper bound on the support: one an edge, and the axes for a segment or point.
    pub edges: Vec<(Point, f64)>,
    /// False if there were more vertices than wanted.
    pub complete: bool,
}

/// An edge whose normal is this close to an axis has that axis for normal.
const SAME_DIRECTION: f64 = 1e-9;

/// More vertices than this are not looked for: the half-planes found until then hold the set.
pub(crate) const MOST_VERTICES: usize = 2048;

impl Polygon {
    /// The polygon of the set that `extreme` describes; points closer than `near` are the same vertex.
    ///
    /// A segment has 2 vertices, a point 1. Fails as `extreme` does.
    pub fn grow(
        near: f64,
        extreme: impl FnMut(Point) -> Result<Extreme2, SetError>,
    ) -> Result<Self, SetError> {
        Self::grow_within(near, MOST_VERTICES, extreme)
    }

    /// As [`Polygon::grow`]; no more than `most` vertices are looked for.
    pub fn grow_within(
        near: f64,
        most: usize,
        mut extreme: impl FnMut(Point) -> Result<Extreme2, SetError>,
    ) -> Result<Self, SetError> {
        let mut points: Vec<Point> = Vec::new();
        let mut axes: Vec<(Point, f64)> = Vec::new();
        for d in [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]] {
            let (upper, v) = extreme(d)?;
            axes.push((d, upper));
            if points.iter().all(|p| distance(*p, v) > near) {
                points.push(v);
            }
        }
        if points.len() == 1 {
            return Ok(Self {
                points,
                edges: axes,
                complete: true,
            });
        }
        let mut edges: Vec<(Point, f64)> = Vec::new();
        // Every edge is either confirmed or split in two. A split adds a vertex that is beyond the edge and
        // is not there yet: where rounding puts an old vertex beyond an edge, the edge stays as it is.
        let (mut edge, mut complete) = (0, true);
        while edge < points.len() {
            let (p, q) = (points[edge], points[(edge + 1) % points.len()]);
            let length = distance(p, q);
            let normal = [(q[1] - p[1]) / length, (p[0] - q[0]) / length];
            let along_axis = axes
                .iter()
                .find(|(d, _)| distance(*d, normal) < SAME_DIRECTION);
            if let Some(&known) = along_axis {
                edges.push(known);
                edge += 1;
                continue;
            }
            let (upper, v) = extreme(normal)?;
            let beyond = normal[0] * (v[0] - p[0]) + normal[1] * (v[1] - p[1]);
            let is_new = || points.iter().all(|p| distance(*p, v) > near);
            let splits = beyond > near && is_new();
            complete &= !splits || points.len() < most;
            if splits && points.len() < most {
                points.insert(edge + 1, v);
            } else {
                edges.push((normal, upper));
                edge += 1;
            }
        }
        if points.len() == 2 {
            edges.extend(axes);
        }
        Ok(Self {
            points: without_straight_corners(points, near),
            edges,
            complete,
        })
    }

    /// The area by the shoelace formula over the vertices; rounded to nearest.
    pub fn area(&self) -> f64 {
        let v = &self.points;
        let o = v[0];
        let corner = |p: Point| [p[0] - o[0], p[1] - o[1]];
        let pairs = v.windows(2).map(|w| (corner(w[0]), corner(w[1])));
        pairs
            .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
            .sum::<f64>()
            .max(0.0)
            + 0.0
    }
}

fn distance(p: Point, q: Point) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
}

/// The polygon without vertices that lie within `near` of the line through their neighbours: extreme
/// points along the axes may lie inside an edge.
fn without_straight_corners(polygon: Vec<Point>, near: f64) -> Vec<Point> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Supports of a disc whose points are off by far more than `near`, in turn inward and outward.
    fn shaken(near: f64, error: f64) -> (Polygon, usize) {
        let mut asked = 0;
        let polygon = Polygon::grow(near, |d| {
            asked += 1;
            let size = libm::hypot(d[0], d[1]);
            let r = 1.0 + if asked % 2 == 0 { error } else { -error };
            Ok((1.0 + error, [r * d[0] / size, r * d[1] / size]))
        });
        (polygon.expect("nothing fails"), asked)
    }

    #[test]
    fn the_sweep_ends_where_points_are_worse_than_its_tolerance() {
        let (polygon, asked) = shaken(1e-14, 1e-6);
        assert!(polygon.points.len() <= MOST_VERTICES);
        assert!(asked <= 2 * MOST_VERTICES + 4);
        assert!(polygon.edges.iter().all(|(_, upper)| *upper == 1.0 + 1e-6));
    }
}
