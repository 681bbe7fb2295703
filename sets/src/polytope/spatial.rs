//! The faces of a convex body in three dimensions, by growing a polyhedron inside it until every facet is
//! confirmed.
//!
//! The outward normal of a facet is a direction to maximise; a vertex beyond it replaces all facets that
//! it sees by the cone over their rim.

use crate::SetError;
use std::collections::BTreeMap;

pub(crate) type Point = [f64; 3];

/// What is known of one direction: an upper bound on the support, and a point where it is attained up to
/// rounding.
pub(crate) type Extreme3 = (f64, Point);

/// A triangle of three vertices' indices, counter-clockwise from outside, with unit normal n and
/// offset o: nᵀx ≤ o inside.
pub(crate) struct Facet {
    pub corners: [usize; 3],
    pub normal: Point,
    offset: f64,
    /// A normal of this face and the upper bound on the support along it, once it was asked for.
    pub confirmed: Option<(Point, f64)>,
}

impl Facet {
    /// `None` if the corners lie on a line.
    fn new(corners: [usize; 3], points: &[Point]) -> Option<Self> {
        let [a, b, c] = corners.map(|i| points[i]);
        let n = cross(minus(b, a), minus(c, a));
        let length = dot(n, n).sqrt();
        (length > 0.0).then(|| {
            let normal = n.map(|x| x / length);
            Self {
                corners,
                normal,
                offset: dot(normal, a),
                confirmed: None,
            }
        })
    }

    fn height(&self, p: Point) -> f64 {
        dot(self.normal, p) - self.offset
    }
}

/// A polyhedron by its vertices and its triangles.
pub(crate) struct Polyhedron {
    pub points: Vec<Point>,
    pub facets: Vec<Facet>,
}

/// Twice the area of a triangle below which it is left out of the half-spaces.
const SLIVER: f64 = 1e-8;

/// A body with more vertices than this is left as it is; its half-spaces hold all the same.
pub(crate) const MOST_VERTICES: usize = 1000;

/// Normals closer than this, of triangles with the same offset, are those of one face.
const SAME_FACE: f64 = 1e-9;

impl Polyhedron {
    /// The polyhedron of the body that `extreme` describes; `None` if the body is flat within `near`.
    ///
    /// Points closer than `near` to a facet lie on it. A triangle in the plane of a confirmed one is
    /// confirmed with it. Fails as `extreme` does.
    pub fn grow(
        near: f64,
        extreme: impl FnMut(Point) -> Result<Extreme3, SetError>,
    ) -> Result<Option<Self>, SetError> {
        Self::grow_within(near, MOST_VERTICES, extreme)
    }

    /// As [`Polyhedron::grow`]; with more than `most` vertices every triangle is left as it is, and below
    /// [`MOST_VERTICES`] not even asked for.
    pub fn grow_within(
        near: f64,
        most: usize,
        mut extreme: impl FnMut(Point) -> Result<Extreme3, SetError>,
    ) -> Result<Option<Self>, SetError> {
        let Some(points) = tetrahedron(near, |d| extreme(d).map(|(_, x)| x))? else {
            return Ok(None);
        };
        let facets = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
            .into_iter()
            .filter_map(|corners| Facet::new(corners, &points))
            .collect();
        let mut body = Self { points, facets };
        while let Some(next) = body.facets.iter().position(|f| f.confirmed.is_none()) {
            let (normal, offset) = (body.facets[next].normal, body.facets[next].offset);
            let known = body.facets.iter().find_map(|f| {
                let apart = minus(f.normal, normal);
                let same =
                    dot(apart, apart) < SAME_FACE * SAME_FACE && (f.offset - offset).abs() <= near;
                f.confirmed.filter(|_| same)
            });
            if known.is_some() {
                body.facets[next].confirmed = known;
                continue;
            }
            let (upper, v) = extreme(normal)?;
            // A triangle so thin that its normal is rounding may have a vertex beyond it; what was proved of
            // that direction stands all the same.
            let known = |p: &Point| {
                let apart = minus(*p, v);
                dot(apart, apart) <= near * near
            };
            if body.facets[next].height(v) <= near || body.points.iter().any(known) {
                body.facets[next].confirmed = Some((normal, upper));
                continue;
            }
            body.points.push(v);
            if body.points.len() > most && most < MOST_VERTICES {
                break;
            }
            if body.points.len() > most || !body.replace_seen(next, near) {
                body.facets[next].confirmed = Some((normal, upper));
            }
        }
        Ok(Some(body))
    }

    /// Whether the triangle is so thin that its normal is rounding; the body's size is about 1.
    pub fn is_sliver(&self, f: &Facet) -> bool {
        let [a, b, c] = f.corners.map(|i| self.points[i]);
        let n = cross(minus(b, a), minus(c, a));
        dot(n, n).sqrt() < SLIVER
    }

    /// The volume, by cones over the facets from the first vertex; rounded to nearest.
    pub fn volume(&self) -> f64 {
        let o = self.points[0];
        let cone = |f: &Facet| {
            let [a, b, c] = f.corners.map(|i| minus(self.points[i], o));
            dot(a, cross(b, c)) / 6.0
        };
        self.facets.iter().map(cone).sum::<f64>().max(0.0) + 0.0
    }

    /// Replaces the facets that the last point sees, and that hang together with facet `from`, by triangles to
    /// their rim; false (and no change) if rounding has made the rim anything but one simple loop, or a
    /// triangle flat.
    fn replace_seen(&mut self, from: usize, near: f64) -> bool {
        let (points, facets) = (&self.points, &mut self.facets);
        let (v, apex) = (points[points.len() - 1], points.len() - 1);
        let edges = |f: &Facet| {
            let [a, b, c] = f.corners;
            [(a, b), (b, c), (c, a)]
        };
        let owner: BTreeMap<(usize, usize), usize> = facets
            .iter()
            .enumerate()
            .flat_map(|(i, f)| edges(f).map(|e| (e, i)))
            .collect();
        let mut seen = vec![false; facets.len()];
        seen[from] = true;
        let (mut reached, mut rim) = (vec![from], BTreeMap::new());
        while let Some(i) = reached.pop() {
            for (a, b) in edges(&facets[i]) {
                let Some(&beside) = owner.get(&(b, a)) else {
                    return false;
                };
                if !seen[beside] && facets[beside].height(v) > 0.1 * near {
                    seen[beside] = true;
                    reached.push(beside);
                }
            }
        }
        for (f, _) in facets.iter().zip(&seen).filter(|(_, s)| **s) {
            for (a, b) in edges(f) {
                // Each corner of a simple loop is left once.
                if !seen[owner[&(b, a)]] && rim.insert(a, b).is_some() {
                    return false;
                }
            }
        }
        let Some((&first, _)) = rim.first_key_value() else {
            return false;
        };
        let (mut at, mut length) = (first, 0);
        while length < rim.len() {
            let Some(&next) = rim.get(&at) else {
                return false;
            };
            (at, length) = (next, length + 1);
            if at == first {
                break;
            }
        }
        if at != first || length != rim.len() {
            return false;
        }
        let cone: Option<Vec<Facet>> = rim
            .iter()
            .map(|(&a, &b)| Facet::new([a, b, apex], points))
            .collect();
        let Some(cone) = cone else { return false };
        let mut keep = seen.iter().map(|s| !s);
        facets.retain(|_| keep.next().unwrap_or(true));
        facets.extend(cone);
        true
    }
}

/// Four extreme points that span a volume, positively oriented so that facet (0, 1, 2) looks away from
/// 3; `None` if the set is flat.
fn tetrahedron(
    near: f64,
    mut extreme: impl FnMut(Point) -> Result<Point, SetError>,
) -> Result<Option<Vec<Point>>, SetError> {
    let mut widest = (near, None);
    for d in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let (p, q) = (extreme(d)?, extreme(d.map(|x| -x))?);
        let width = dot(d, minus(p, q));
        if width > widest.0 {
            widest = (width, Some((p, q)));
        }
    }
    let Some((p, q)) = widest.1 else {
        return Ok(None);
    };
    // Two normals of the line; the point farthest from it along either.
    let [first, second] = normals_of_line(minus(q, p));
    let mut third = (near, None);
    for d in [first, first.map(|x| -x), second, second.map(|x| -x)] {
        let x = extreme(d)?;
        let distance = dot(d, minus(x, p));
        if distance > third.0 {
            third = (distance, Some(x));
        }
    }
    let Some(r) = third.1 else { return Ok(None) };
    let normal = unit(cross(minus(q, p), minus(r, p)));
    let below = extreme(normal.map(|x| -x))?;
    if dot(normal, minus(p, below)) > near {
        return Ok(Some(vec![p, q, r, below]));
    }
    let above = extreme(normal)?;
    if dot(normal, minus(above, p)) > near {
        return Ok(Some(vec![p, r, q, above]));
    }
    Ok(None)
}

/// Two unit vectors that are normal to the line along `along` and to each other.
fn normals_of_line(along: Point) -> [Point; 2] {
    let axis = if along[0].abs() <= along[1].abs().min(along[2].abs()) {
        [1.0, 0.0, 0.0]
    } else if along[1].abs() <= along[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let first = unit(cross(along, axis));
    [first, unit(cross(along, first))]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: Point) -> Point {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}
