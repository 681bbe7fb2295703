//! Volume in three dimensions, by growing a polyhedron inside the set until every facet is confirmed.
//!
//! As in the plane: the outward normal of a facet is a direction to maximise; a vertex beyond it replaces
//! all facets that it sees by the cone over their rim.

use super::ConstrainedZonotope;
use super::planar::NEAR;
use crate::SetError;
use crate::lp::LinearProgram;

type Point = [f64; 3];

/// A triangle of three vertices' indices, counter-clockwise from outside, with unit normal n and
/// offset o: nᵀx ≤ o inside.
struct Facet {
    corners: [usize; 3],
    normal: Point,
    offset: f64,
    confirmed: bool,
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
                confirmed: false,
            }
        })
    }

    fn height(&self, p: Point) -> f64 {
        dot(self.normal, p) - self.offset
    }
}

impl ConstrainedZonotope {
    /// Length, area or volume for n = 1, 2, 3, rounded to nearest; `None` in higher dimensions.
    ///
    /// r and δ do not enter. Fails with `Empty` if the set is proved empty.
    pub fn volume(&self) -> Result<Option<f64>, SetError> {
        match self.dim() {
            1 => Ok(Some(self.interval_hull()?[0].width())),
            2 => self.area().map(Some),
            3 => self.volume_3d().map(Some),
            _ => Ok(None),
        }
    }

    fn volume_3d(&self) -> Result<f64, SetError> {
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        let near = NEAR * self.z.radius().iter().sum::<f64>();
        let extreme = |d: Point, lp: &mut LinearProgram| -> Result<Point, SetError> {
            let x = self.extreme_point(&d, lp)?;
            Ok([x[0], x[1], x[2]])
        };
        let Some(mut points) = tetrahedron(near, |d| extreme(d, &mut lp))? else {
            return Ok(0.0);
        };
        let mut facets: Vec<Facet> = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
            .into_iter()
            .filter_map(|corners| Facet::new(corners, &points))
            .collect();
        while let Some(next) = facets.iter().position(|f| !f.confirmed) {
            let v = extreme(facets[next].normal, &mut lp)?;
            if facets[next].height(v) <= near {
                facets[next].confirmed = true;
                continue;
            }
            points.push(v);
            if !grow(&mut facets, &points, near) {
                facets[next].confirmed = true;
            }
        }
        let o = points[0];
        let cone = |f: &Facet| {
            let [a, b, c] = f.corners.map(|i| minus(points[i], o));
            dot(a, cross(b, c)) / 6.0
        };
        Ok(facets.iter().map(cone).sum::<f64>().max(0.0))
    }
}

/// Replaces the facets that the last point sees by triangles to their rim; false (and no change) if a
/// triangle would be flat.
fn grow(facets: &mut Vec<Facet>, points: &[Point], near: f64) -> bool {
    let (v, apex) = (points[points.len() - 1], points.len() - 1);
    let seen: Vec<bool> = facets.iter().map(|f| f.height(v) > 0.1 * near).collect();
    let mut edges: Vec<(usize, usize)> = Vec::new();
    for (f, _) in facets.iter().zip(&seen).filter(|(_, s)| **s) {
        let [a, b, c] = f.corners;
        edges.extend([(a, b), (b, c), (c, a)]);
    }
    // An edge of two seen facets appears in both directions; the rim in one.
    let rim: Vec<(usize, usize)> = edges
        .iter()
        .copied()
        .filter(|&(a, b)| !edges.contains(&(b, a)))
        .collect();
    let cone: Option<Vec<Facet>> = rim
        .iter()
        .map(|&(a, b)| Facet::new([a, b, apex], points))
        .collect();
    let Some(cone) = cone else { return false };
    let mut keep = seen.iter().map(|s| !s);
    facets.retain(|_| keep.next().unwrap_or(true));
    facets.extend(cone);
    true
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
    let along = minus(q, p);
    let axis = if along[0].abs() <= along[1].abs().min(along[2].abs()) {
        [1.0, 0.0, 0.0]
    } else if along[1].abs() <= along[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let first = unit(cross(along, axis));
    let second = unit(cross(along, first));
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

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
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
