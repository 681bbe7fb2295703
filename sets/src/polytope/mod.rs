//! Polytopes by half-spaces whose offsets are proved, with their vertices where n ≤ 3.
//!
//! A polytope is { x ∈ B : lo_i ≤ a_iᵀx ≤ hi_i } for a box B and slabs. It is a set of exact f64
//! coefficients: [`Polytope::enclosing`] finds the facets of a constrained zonotope by a sweep of supports,
//! heuristically, and takes the offset of each from a certified linear program; so whatever the sweep does,
//! the polytope contains the set, and it is the set up to rounding when the sweep ends. A half-space that is
//! left out can only make it larger.
//!
//! `planar` and `spatial` sweep in two and three dimensions; `thinned` bounds the number of facets, `clipped` cuts
//! a box by them; `bundle` turns a polytope into rotated boxes.

mod bundle;
mod clipped;
pub(crate) mod planar;
pub(crate) mod spatial;
mod thinned;

pub use bundle::Frame;
pub use thinned::FacetBound;

use crate::interval_vector::same_dimension;
use crate::lp::LinearProgram;
use crate::units::{divided_rows, of_set, picked, product as product_of, times};
use crate::{
    ConstrainedZonotope, Containment, Interval, IntervalVector, List, Matrix, SetError, Zonotope,
};
use planar::Polygon;
use spatial::Polyhedron;

/// The points between two parallel hyperplanes: { x : aᵀx ∈ range }.
#[derive(Clone, Debug, PartialEq)]
pub struct Slab {
    /// a, not zero; of any length.
    pub normal: Vec<f64>,
    /// Where aᵀx lies.
    pub range: Interval,
}

impl Slab {
    /// The component j and a_j if that is the only one of a and a power of two: then the slab is a side of a box, exactly.
    fn side(&self) -> Option<(usize, f64)> {
        picked(&self.normal)
    }

    /// aᵀx over a box, rounded outward.
    pub fn product(&self, x: &[Interval]) -> Interval {
        product(&self.normal, x)
    }
}

/// { x ∈ B : a_iᵀx ∈ range_i }, bounded.
///
/// # Laws
///
/// - [`Polytope::enclosing`] contains its argument; the hull contains the polytope and is that of the
///   argument up to rounding;
/// - [`Polytope::to_constrained_zonotope`] is the same set up to rounding outward;
/// - the intersection of the boxes of [`Polytope::frames`] contains the polytope, and is it up to rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct Polytope {
    hull: IntervalVector,
    slabs: Vec<Slab>,
    vertices: Vec<Vec<f64>>,
    volume: Option<f64>,
}

/// Points closer than this times the size of the set, component by component, are the same vertex.
const NEAR: f64 = 1e-10;

/// Unit normals closer than this are those of one face: what rounding makes of many vertices in one plane
/// is not to become many facets. The half-spaces left out can only make the polytope larger.
///
/// Normals are compared in the coordinates diag(u)⁻¹ x, u the powers of two at or below the half-widths of the set: in
/// a state's own coordinates two faces of a set a million times longer than wide have nearly the same normal.
const SAME_NORMAL: f64 = 1e-6;

impl Polytope {
    /// The box; its facets are those of the box. Vertices and volume are given for n ≤ 3.
    pub fn from_box(hull: &IntervalVector) -> Self {
        let n = hull.dim();
        let unit = |i: usize| (0..n).map(|j| f64::from(i == j)).collect();
        let slabs = hull.iter().enumerate().map(|(i, &range)| Slab {
            normal: unit(i),
            range,
        });
        // Counter-clockwise in the plane, as an outline has them.
        let corner = |bits: usize| {
            let bits = bits ^ ((bits >> 1) & 1);
            hull.iter()
                .enumerate()
                .map(|(i, side)| {
                    if bits >> i & 1 == 1 {
                        side.hi()
                    } else {
                        side.lo()
                    }
                })
                .collect()
        };
        let small = n <= 3;
        Self {
            slabs: slabs.collect(),
            vertices: if small {
                (0..1 << n).map(corner).collect()
            } else {
                Vec::new()
            },
            volume: small.then(|| product_of(hull.widths())),
            hull: hull.clone(),
        }
    }

    /// { x ∈ B : every slab }, as given: slabs that do not touch the set are kept and vertices not sought
    /// ([`Polytope::simplified`]).
    ///
    /// Fails with `Dimension`, or `NotFinite` at a coefficient.
    pub fn new(hull: IntervalVector, slabs: Vec<Slab>) -> Result<Self, SetError> {
        const OP: &str = "polytope";
        for slab in &slabs {
            same_dimension(OP, hull.dim(), slab.normal.len())?;
            if let Some(&value) = slab.normal.iter().find(|a| !a.is_finite()) {
                return Err(SetError::NotFinite { op: OP, value });
            }
        }
        Ok(Self {
            hull: hull.finite(OP)?,
            slabs,
            vertices: Vec::new(),
            volume: None,
        })
    }

    /// The smallest polytope around the constrained zonotope: its facets, each offset a certified support.
    ///
    /// See [`Polytope::enclosing_with`].
    pub fn enclosing(set: &ConstrainedZonotope) -> Result<Self, SetError> {
        Self::enclosing_with(set, &mut LinearProgram::new())
    }

    /// As [`Polytope::enclosing`], with the buffers of `lp`. About two linear programs a vertex in the
    /// plane, one a vertex and one a facet in space.
    ///
    /// Normals and points are compared in units of the set's half-widths, so that a change of the components' units by
    /// powers of two changes slabs, vertices and volume by these factors and in no other way.
    ///
    /// A set that is flat within 1e-10 of its size has volume 0; in space its polytope may then be larger
    /// than the set within its plane.
    ///
    /// Fails with `Range` for n > 3, `Empty` if the set is proved empty, `NotFinite` on overflow.
    pub fn enclosing_with(
        set: &ConstrainedZonotope,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        Ok(Self::swept(set, usize::MAX, lp)?.0)
    }

    /// As [`Polytope::enclosing_with`], and whether the sweep ended within `most_vertices`. If it did not, the
    /// slabs are those of all directions asked for.
    fn swept(
        set: &ConstrainedZonotope,
        most_vertices: usize,
        lp: &mut LinearProgram,
    ) -> Result<(Self, bool), SetError> {
        const OP: &str = "facets of a constrained zonotope";
        let n = set.dim();
        if n > 3 {
            return Err(SetError::Range {
                op: OP,
                what: "the dimension",
                expected: "1, 2 or 3",
                got: n as f64,
            });
        }
        if n == 1 {
            return Ok((Self::from_box(&set.interval_hull_with(lp)?), true));
        }
        let mut sweep = Sweep::new(set, lp)?;
        let near = NEAR * n as f64;
        let (mut halves, points, volume, complete) = if n == 2 {
            let most = most_vertices.min(planar::MOST_VERTICES);
            let polygon = Polygon::grow_within(near, most, |d| sweep.extreme(d))?;
            let area = polygon.area();
            let own = |(d, u): &([f64; 2], f64)| sweep.half(d, *u);
            let halves: Vec<Half> = polygon.edges.iter().map(own).collect();
            let points: Vec<Vec<f64>> = polygon.points.iter().map(|p| p.to_vec()).collect();
            (halves, points, area, polygon.complete)
        } else {
            let most = most_vertices.min(spatial::MOST_VERTICES);
            let body = Polyhedron::grow_within(near, most, |d| sweep.extreme(d))?;
            match body {
                Some(body) => {
                    let volume = body.volume();
                    let halves = body.facets.iter().filter(|f| !body.is_sliver(f));
                    let halves = halves.filter_map(|f| f.confirmed);
                    let used = |i: &usize| body.facets.iter().any(|f| f.corners.contains(i));
                    let points = (0..body.points.len()).filter(used);
                    (
                        halves.map(|(d, u)| sweep.half(&d, u)).collect(),
                        points.map(|i| body.points[i].to_vec()).collect(),
                        volume,
                        body.points.len() <= most,
                    )
                }
                None => (std::mem::take(&mut sweep.asked), Vec::new(), 0.0, true),
            }
        };
        if !complete && most_vertices < usize::MAX {
            halves = std::mem::take(&mut sweep.asked);
        }
        Ok((sweep.polytope(&halves, points, volume)?, complete))
    }

    /// The polytope with the slabs that touch it alone, its hull tight, its vertices and volume known.
    ///
    /// Fails as [`Polytope::enclosing`].
    pub fn simplified(&self, lp: &mut LinearProgram) -> Result<Self, SetError> {
        Self::enclosing_with(&self.to_constrained_zonotope()?, lp)
    }

    /// n.
    pub fn dim(&self) -> usize {
        self.hull.dim()
    }

    /// A box that contains the polytope; the smallest up to rounding where the facets were found.
    pub fn hull(&self) -> &IntervalVector {
        &self.hull
    }

    /// The slabs, those along an axis included where they are facets.
    pub fn slabs(&self) -> &[Slab] {
        &self.slabs
    }

    /// The vertices, rounded to nearest, counter-clockwise in the plane; none where they were not sought.
    pub fn vertices(&self) -> &[Vec<f64>] {
        &self.vertices
    }

    /// Length, area or volume, rounded to nearest; `None` where the vertices were not sought.
    pub fn volume(&self) -> Option<f64> {
        self.volume
    }

    /// The same set as ⟨c, diag(r), A, b, δ⟩: one generator a component, one row |A ξ − b| ≤ δ a slab that is
    /// not along an axis.
    ///
    /// [`ConstrainedZonotope::fold`] makes the slack generators: n + m of them with m equations. Exact but for
    /// rounding, which is charged to δ. Fails with `Empty` or `NotFinite`.
    ///
    /// Source: \[Rego2020, Sec. 2\], the half-space intersection of Raghuraman and Koeln 2022.
    pub fn to_constrained_zonotope(&self) -> Result<ConstrainedZonotope, SetError> {
        const OP: &str = "polytope";
        let mut sides = self.hull.clone().into_sides();
        for slab in &self.slabs {
            if let Some((j, a)) = slab.side() {
                let range = slab.range / a;
                sides[j] = sides[j]
                    .intersect(&range)
                    .ok_or(SetError::Empty { op: OP })?;
            }
        }
        let inclined: Vec<Slab> = self
            .slabs
            .iter()
            .filter(|s| s.side().is_none())
            .cloned()
            .collect();
        ConstrainedZonotope::from_box(&IntervalVector::new(sides))?.within(&inclined)
    }

    /// The intersection: the box of both hulls and the slabs of both. Fails with `Dimension` or `Empty`.
    pub fn intersect(&self, other: &Self) -> Result<Self, SetError> {
        let hull = self.hull.intersect(&other.hull)?;
        Self::new(hull, [&self.slabs[..], &other.slabs].concat())
    }

    /// Whether the point that the box `x` holds is in the polytope. `Undecided` where `x` has not n components.
    pub fn contains(&self, x: &[Interval]) -> Containment {
        if x.len() != self.dim() {
            return Containment::Undecided;
        }
        let mut verdict = Containment::Inside;
        let sides = self.hull.iter().copied().zip(x.iter().copied());
        let products = self.slabs.iter().map(|s| (s.range, s.product(x)));
        for (range, value) in sides.chain(products) {
            if range.intersect(&value).is_none() {
                return Containment::Outside;
            }
            if !range.contains_interval(value) {
                verdict = Containment::Undecided;
            }
        }
        verdict
    }

    /// The polytope of a zonotope of the plane or of space: a slab for every pair of generators (a line in the
    /// plane, whose normal it has; a plane in space), its range a bound on the support.
    ///
    /// Contains the zonotope, and is it up to rounding where the generators span. Vertices are not sought.
    /// Fails with `Range` unless n ≤ 3, `NotFinite` on overflow.
    pub fn of_zonotope(z: &Zonotope) -> Result<Self, SetError> {
        let n = z.dim();
        let hull = z.interval_hull()?;
        let units = of_set(z.c(), &z.radius());
        let scaled = divided_rows(z.g(), &units);
        let columns: Vec<Vec<f64>> = (0..z.generators())
            .map(|j| scaled.col(j).into_vec())
            .collect();
        let mut normals: Vec<Vec<f64>> = Vec::new();
        let mut offer = |normal: Vec<f64>| {
            if let Some(normal) = unit(&normal)
                && normals.iter().all(|a| !parallel(a, &normal))
            {
                normals.push(normal);
            }
        };
        match n {
            1 => {}
            2 => columns.iter().for_each(|g| offer(vec![-g[1], g[0]])),
            3 => {
                for (i, g) in columns.iter().enumerate() {
                    for h in &columns[..i] {
                        let d = spatial::cross([g[0], g[1], g[2]], [h[0], h[1], h[2]]);
                        offer(d.to_vec());
                    }
                }
            }
            _ => {
                return Err(SetError::Range {
                    op: "half-spaces of a zonotope",
                    what: "the dimension",
                    expected: "1, 2 or 3",
                    got: n as f64,
                });
            }
        }
        let slabs = normals.into_iter().filter(|a| axis(a).is_none());
        let slabs = slabs.map(|normal| {
            let normal = divided(&normal, &units);
            let minus: Vec<f64> = normal.iter().map(|x| -x).collect();
            let range = Interval::new(-z.support(&minus)?, z.support(&normal)?)?;
            Ok(Slab { normal, range })
        });
        let slabs = slabs.collect::<Result<Vec<_>, SetError>>()?;
        Self::new(hull, slabs)
    }
}

/// A half-space { x : ownᵀx ≤ upper }.
struct Half {
    /// Its normal in the scaled coordinates, of length 1.
    scaled: Vec<f64>,
    /// The same in the set's own.
    own: Vec<f64>,
    upper: f64,
}

/// Supports of a set in the coordinates diag(u)⁻¹ (x − c), u the powers of two at or below the half-widths of its
/// generators' box. A change of units by powers of two changes none of the numbers in these coordinates.
struct Sweep<'a> {
    set: &'a ConstrainedZonotope,
    lp: &'a mut LinearProgram,
    units: List<f64>,
    /// Upper bounds on x_j and on −x_j, as they were found.
    axes: Vec<[Option<f64>; 2]>,
    /// Every direction asked for, with its bound.
    asked: Vec<Half>,
}

impl<'a> Sweep<'a> {
    fn new(set: &'a ConstrainedZonotope, lp: &'a mut LinearProgram) -> Result<Self, SetError> {
        set.load(lp)?;
        Ok(Self {
            set,
            lp,
            units: of_set(set.c(), &set.zonotope().radius()),
            axes: vec![[None; 2]; set.dim()],
            asked: Vec::new(),
        })
    }

    /// The direction `d` of the scaled coordinates in the set's own; ±e_j exactly where d is that but for rounding.
    fn direction(&self, d: &[f64]) -> Vec<f64> {
        match axis_like(d) {
            Some(j) => {
                let mut e = vec![0.0; d.len()];
                e[j] = d[j].signum();
                e
            }
            None => divided(d, &self.units),
        }
    }

    fn half(&self, d: &[f64], upper: f64) -> Half {
        Half {
            scaled: d.to_vec(),
            own: self.direction(d),
            upper,
        }
    }

    /// The certified support in the direction that belongs to `d`, in the set's coordinates, and the point
    /// where it is attained, in the scaled ones.
    fn extreme<const N: usize>(&mut self, d: [f64; N]) -> Result<(f64, [f64; N]), SetError> {
        let own = self.direction(&d);
        let upper = self.support(own, &d)?;
        let offset = self.set.g().mul_vec(self.lp.point());
        Ok((upper, std::array::from_fn(|i| offset[i] / self.units[i])))
    }

    fn support(&mut self, own: Vec<f64>, scaled: &[f64]) -> Result<f64, SetError> {
        let upper = self.set.support_loaded(&own, self.lp)?;
        if let Some(j) = axis(&own) {
            self.axes[j][usize::from(own[j] < 0.0)] = Some(upper);
        }
        self.asked.push(Half {
            scaled: scaled.to_vec(),
            own,
            upper,
        });
        Ok(upper)
    }

    /// The hull from the supports along the axes, asking for those that are missing.
    fn hull(&mut self) -> Result<IntervalVector, SetError> {
        let n = self.set.dim();
        let mut sides = Vec::with_capacity(n);
        for j in 0..n {
            let mut bounds = [0.0; 2];
            for (side, bound) in bounds.iter_mut().enumerate() {
                *bound = match self.axes[j][side] {
                    Some(upper) => upper,
                    None => {
                        let mut e = vec![0.0; n];
                        e[j] = if side == 0 { 1.0 } else { -1.0 };
                        self.support(e.clone(), &e)?
                    }
                };
            }
            sides.push(ordered(-bounds[1], bounds[0])?);
        }
        Ok(IntervalVector::new(sides))
    }

    /// The polytope of the half-spaces, which are in the set's own coordinates.
    fn polytope(
        mut self,
        halves: &[Half],
        points: Vec<Vec<f64>>,
        volume: f64,
    ) -> Result<Polytope, SetError> {
        let hull = self.hull()?;
        let mut slabs: Vec<Slab> = Vec::new();
        let mut taken: Vec<&[f64]> = Vec::new();
        for (i, half) in halves.iter().enumerate() {
            if taken.iter().any(|d| parallel(d, &half.scaled)) {
                continue;
            }
            let normal = &half.own;
            let range = if let Some(j) = axis(normal) {
                if normal[j] < 0.0 { -hull[j] } else { hull[j] }
            } else {
                let opposite = halves[i + 1..]
                    .iter()
                    .any(|other| distance_of_sum(&other.scaled, &half.scaled) < SAME_NORMAL);
                let minus = |a: &[f64]| -> Vec<f64> { a.iter().map(|x| -x).collect() };
                let lower = if opposite {
                    -self.support(minus(normal), &minus(&half.scaled))?
                } else {
                    product(normal, hull.as_slice()).lo()
                };
                ordered(lower, half.upper)?
            };
            taken.push(&half.scaled);
            slabs.push(Slab {
                normal: normal.clone(),
                range,
            });
        }
        // A set that is flat but for rounding may have vertices where the programs end beside it: the hull,
        // which is proved, bounds both.
        let back = |p: Vec<f64>| {
            let own = p.iter().zip(&self.units).zip(self.set.c()).zip(&hull);
            own.map(|(((p, u), c), side)| (c + p * u).clamp(side.lo(), side.hi()))
                .collect()
        };
        let volume = times(volume, &self.units);
        Ok(Polytope {
            vertices: points.into_iter().map(back).collect(),
            volume: Some(volume.min(product_of(hull.widths()))),
            hull,
            slabs,
        })
    }
}

/// [lower, upper]; `Empty` if a certified upper bound lies below a certified lower one.
fn ordered(lower: f64, upper: f64) -> Result<Interval, SetError> {
    Interval::new(lower, upper).map_err(|error| match error {
        SetError::Reversed { .. } => SetError::Empty {
            op: "facets of a constrained zonotope",
        },
        other => other,
    })
}

/// aᵀx, rounded outward.
fn product(a: &[f64], x: &[Interval]) -> Interval {
    let terms = a.iter().zip(x).filter(|(a, _)| **a != 0.0);
    // Exact for any power of two, as it is for 1.
    let mut terms = terms.map(|(&a, &x)| x * a);
    let first = terms.next().unwrap_or(Interval::ZERO);
    terms.fold(first, |sum, term| sum + term)
}

/// a/|a|, unless it is 0 or not finite.
fn unit(a: &[f64]) -> Option<Vec<f64>> {
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let a: Vec<f64> = a.iter().map(|x| x / largest).collect();
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(a.iter().map(|x| x / length).collect())
}

/// diag(`units`)⁻¹ a.
fn divided(a: &[f64], units: &[f64]) -> Vec<f64> {
    a.iter().zip(units).map(|(a, u)| a / u).collect()
}

/// Whether two unit vectors of the scaled coordinates point along one line.
fn parallel(a: &[f64], b: &[f64]) -> bool {
    let minus: Vec<f64> = b.iter().map(|x| -x).collect();
    distance_of_sum(a, b) < SAME_NORMAL || distance_of_sum(a, &minus) < SAME_NORMAL
}

/// |a + b|.
fn distance_of_sum(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a + b) * (a + b))
        .sum::<f64>()
        .sqrt()
}

/// j if a = ±e_j.
fn axis(a: &[f64]) -> Option<usize> {
    let mut nonzero = a.iter().enumerate().filter(|(_, x)| **x != 0.0);
    match (nonzero.next(), nonzero.next()) {
        (Some((j, x)), None) if x.abs() == 1.0 => Some(j),
        _ => None,
    }
}

/// j if all other components of a vanish beside it.
fn axis_like(a: &[f64]) -> Option<usize> {
    let (j, largest) =
        a.iter().enumerate().fold(
            (0, 0.0),
            |m: (usize, f64), (i, x)| {
                if x.abs() > m.1 { (i, x.abs()) } else { m }
            },
        );
    let rest = a.iter().enumerate().filter(|(i, _)| *i != j);
    let alone = largest > 0.0 && rest.map(|(_, x)| x.abs()).sum::<f64>() <= 1e-12 * largest;
    alone.then_some(j)
}

impl ConstrainedZonotope {
    /// Encloses { x ∈ X : a_iᵀx ∈ range_i for every slab }: one row |aᵀG ξ − b| ≤ δ a slab, no generator.
    ///
    /// b and δ are the middle and the half-width of range − aᵀc, evaluated outward, and δ also takes
    /// |a|ᵀ(r + γ_n |G| 1) for the rounding of aᵀG. A range that is infinite on one side ends there where ⟨c, G, r⟩ does; the
    /// whole line says nothing and gives no row. The result may be empty.
    ///
    /// Fails with `Dimension`, `NotFinite` at a coefficient, or `Empty` where a half line misses ⟨c, G, r⟩.
    pub fn within(&self, slabs: &[Slab]) -> Result<Self, SetError> {
        const OP: &str = "intersection with slabs";
        let n = self.dim();
        for slab in slabs {
            same_dimension(OP, n, slab.normal.len())?;
        }
        let bounded: Vec<Slab>;
        let slabs = match slabs.iter().all(|slab| slab.range.is_finite()) {
            true => slabs,
            false => {
                bounded = self.bounded(slabs)?;
                &bounded
            }
        };
        let normals = Matrix::from_fn(slabs.len(), n, |i, j| slabs[i].normal[j]);
        let rows = normals.mul(self.g());
        let sums = self.zonotope().abs_row_sums();
        let (mut b, mut delta) = (self.b().to_vec(), self.delta().to_vec());
        let c: Vec<Interval> = self.c().iter().map(|&c| Interval::point(c)).collect();
        for slab in slabs {
            let target = slab.range - slab.product(&c);
            let charge = slab.normal.iter().enumerate().map(|(j, a)| {
                let rounding = crate::rounding::gamma(n) * sums[j] + crate::rounding::ETA;
                a.abs() * (self.r()[j] + rounding)
            });
            b.push(target.mid());
            delta.push(crate::rounding::up(
                target.rad() + charge.sum::<f64>(),
                n + 5,
            ));
        }
        let a = if self.constraints() == 0 {
            rows
        } else {
            Matrix::vcat(&[self.a(), &rows])
        };
        Self::with_slack(self.zonotope().clone(), a, b, delta)
    }

    /// The slabs with half lines cut where ⟨c, G, r⟩ ends, and without those of the whole line.
    fn bounded(&self, slabs: &[Slab]) -> Result<Vec<Slab>, SetError> {
        let hull = self.zonotope().interval_hull()?;
        let mut bounded = Vec::with_capacity(slabs.len());
        for slab in slabs.iter().filter(|slab| !slab.range.is_entire()) {
            let range =
                match slab.range.is_finite() {
                    true => slab.range,
                    false => slab.range.intersect(&slab.product(hull.as_slice())).ok_or(
                        SetError::Empty {
                            op: "intersection with slabs",
                        },
                    )?,
                };
            bounded.push(Slab {
                normal: slab.normal.clone(),
                range,
            });
        }
        Ok(bounded)
    }
}
