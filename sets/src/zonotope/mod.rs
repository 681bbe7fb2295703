//! Zonotopes that carry their own rounding.
//!
//! ⟨c, G, r⟩ = { c + G ξ + s : |ξ| ≤ 1, |s| ≤ r } with c in ℝⁿ, G n × p, r ≥ 0. Given data have r = 0;
//! every operation adds to r what its own rounding may have cost, so that the result contains the
//! exact result for the f64 coefficients that came in. r is scratch within a step: carried from step to
//! step, |M| r grows where M turns although M contracts. [`Zonotope::fold`] makes it generators.
//!
//! Here are the set itself and what can be asked of it in any dimension; `map` has the operations that
//! make new sets, `planar` what is exact in two dimensions, `membership` the question in more of them, `volume` the volume.

mod map;
mod membership;
mod planar;
mod volume;

use crate::matrix::abs_sum;
use crate::rounding::{ETA, gamma, up};
use crate::{Containment, Interval, IntervalVector, List, Matrix, SetError, ops};

/// The zonotope ⟨c, G, r⟩ = { c + G ξ + s : |ξ| ≤ 1, |s| ≤ r }.
///
/// # Laws
///
/// For zonotopes X, Y, a matrix M and a direction d, up to the rounding that r and the outward bounds
/// account for:
///
/// - ρ(M X, d) = ρ(X, Mᵀ d); ρ(X ⊕ Y, d) = ρ(X, d) + ρ(Y, d); ρ(X × Y, (d, e)) = ρ(X, d) + ρ(Y, e);
/// - the interval hull of X has the bounds −ρ(X, −e_i), ρ(X, e_i);
/// - X ⊆ fold(X), with equal supports; X ⊆ reduce(X);
/// - x ∈ X and y ∈ Y give M x ∈ M X, x + y ∈ X ⊕ Y, dᵀx ≤ ρ(X, d), and `contains` never says `Outside`.
#[derive(Clone, Debug, PartialEq)]
pub struct Zonotope {
    c: List<f64>,
    g: Matrix,
    r: List<f64>,
}

impl Zonotope {
    /// ⟨c, G, 0⟩.
    ///
    /// `g` has as many rows as `c` has entries; it may have no columns. Fails with `Dimension` if shapes
    /// differ or n = 0, with `NotFinite` at a NaN or infinite entry.
    pub fn new(c: impl Into<List<f64>>, g: Matrix) -> Result<Self, SetError> {
        let c = c.into();
        let r = List::filled(0.0, c.len());
        Self::with_rounding(c, g, r)
    }

    /// ⟨c, G, r⟩.
    ///
    /// As [`Zonotope::new`]; fails with `Range` if an entry of `r` is negative.
    pub fn with_rounding(
        c: impl Into<List<f64>>,
        g: Matrix,
        r: impl Into<List<f64>>,
    ) -> Result<Self, SetError> {
        const OP: &str = "zonotope";
        let (c, r) = (c.into(), r.into());
        if c.is_empty() {
            return Err(SetError::Dimension {
                op: OP,
                expected: 1,
                got: 0,
            });
        }
        for got in [g.rows(), r.len()] {
            same(OP, c.len(), got)?;
        }
        if let Some(&got) = r.iter().find(|&&x| x < 0.0) {
            return Err(SetError::Range {
                op: OP,
                what: "rounding box",
                expected: "nonnegative",
                got,
            });
        }
        Self::checked(OP, c, g, r)
    }

    /// ⟨c, G, r⟩ of shapes known to fit, as the result of `op`; an overflow becomes `NotFinite`.
    pub(crate) fn checked(
        op: &'static str,
        c: impl Into<List<f64>>,
        g: Matrix,
        r: impl Into<List<f64>>,
    ) -> Result<Self, SetError> {
        let (c, r) = (c.into(), r.into());
        let entries = c.iter().chain(&r).chain(g.as_slice());
        match entries.into_iter().find(|x| !x.is_finite()) {
            Some(&value) => Err(SetError::NotFinite { op, value }),
            None => Ok(Self { c, g, r }),
        }
    }

    /// The set of the one point `x`. Fails as [`Zonotope::new`].
    pub fn point(x: &[f64]) -> Result<Self, SetError> {
        Self::new(x, Matrix::zeros(x.len(), 0))
    }

    /// A zonotope that contains the box: c its middle, G = diag of its half-widths, rounded up.
    ///
    /// Sides of no width have a zero column. Fails with `Dimension` if n = 0, with `NotFinite` if the
    /// box is unbounded.
    pub fn from_box(sides: &IntervalVector) -> Result<Self, SetError> {
        let radii: List<f64> = sides.iter().map(|side| side.rad()).collect();
        Self::new(sides.mid(), Matrix::diagonal(&radii))
    }

    /// n.
    #[inline]
    pub fn dim(&self) -> usize {
        self.c.len()
    }

    /// p, the number of generators.
    #[inline]
    pub fn generators(&self) -> usize {
        self.g.cols()
    }

    /// The center c.
    #[inline]
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// The generators G, n × p.
    #[inline]
    pub fn g(&self) -> &Matrix {
        &self.g
    }

    /// The half-widths r of the rounding box.
    #[inline]
    pub fn r(&self) -> &[f64] {
        &self.r
    }

    /// The same set with the rounding box made generators: ⟨c, [G, diag(r)], 0⟩, exact.
    ///
    /// Zero entries of r give no column. To be called once a step, before the order is reduced.
    pub fn fold(self) -> Self {
        let columns = box_columns(&self.r);
        if columns.cols() == 0 {
            return self;
        }
        Self {
            g: Matrix::hcat(&[&self.g, &columns]),
            r: List::filled(0.0, self.c.len()),
            c: self.c,
        }
    }

    /// ⌈|G| 1⌉: upper bounds on the row sums of |G|.
    pub fn abs_row_sums(&self) -> List<f64> {
        abs_row_sums_up(&self.g)
    }

    /// ⌈|G| 1 + r⌉: upper bounds on the half-widths of the interval hull.
    pub fn radius(&self) -> List<f64> {
        let depth = self.generators() / 8 + 5;
        ops::count(0, self.dim() * self.generators());
        (0..self.dim())
            .map(|i| up(abs_sum(self.g.row(i)) + self.r[i], depth))
            .collect()
    }

    /// The smallest box that contains the set, rounded outward: [c − (|G| 1 + r), c + (|G| 1 + r)].
    ///
    /// Fails with `NotFinite` if a bound overflows.
    pub fn interval_hull(&self) -> Result<IntervalVector, SetError> {
        IntervalVector::from_center_radius(&self.c, &self.radius())
    }

    /// tr(G Gᵀ) = Σ g_ij², the square of the F-radius, rounded to nearest; r does not enter.
    ///
    /// It belongs to the list of generators, not to the set: `[1 1]` and `[2]` are the same set and give
    /// 2 and 4.
    pub fn trace_ggt(&self) -> f64 {
        (0..self.dim())
            .map(|i| crate::matrix::dot(self.g.row(i), self.g.row(i)))
            .sum()
    }

    /// An upper bound on the support ρ(d) = max { dᵀx : x in the set } = dᵀc + Σ_j |dᵀg_j| + |d|ᵀr.
    ///
    /// Fails with `Dimension`, or `NotFinite` if `d` is not finite or the bound overflows.
    pub fn support(&self, d: &[f64]) -> Result<f64, SetError> {
        Ok(self.support_bounds(d)?.hi())
    }

    /// An interval that contains the support ρ(d) = max { dᵀx : x in the set }.
    ///
    /// Computed as fl(dᵀc) + fl(Σ_j |fl(dᵀg_j)| + |d|ᵀr), widened by γ_n |d|ᵀ(|c| + |G| 1) for the
    /// products and by the rounding of the sums. Fails as [`Zonotope::support`].
    pub fn support_bounds(&self, d: &[f64]) -> Result<Interval, SetError> {
        const OP: &str = "support";
        let n = self.dim();
        same(OP, n, d.len())?;
        if let Some(&value) = d.iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        let row = Matrix::from_fn(1, n, |_, i| d[i]);
        let along_c = row.mul_vec(&self.c)[0];
        let along_g = abs_sum(row.mul(&self.g).row(0));
        let along_r: f64 = d.iter().zip(&self.r).map(|(d, r)| d.abs() * r).sum();
        let spread = along_g + along_r;
        let depth = (self.generators() / 8 + 4).max(n) + 1;
        let sums = self.abs_row_sums();
        let products: f64 = (0..n)
            .map(|i| d[i].abs() * (gamma(n) * (self.c[i].abs() + sums[i]) + ETA))
            .sum();
        // 2 γ_depth bounds the rounding of the sums from either side; ⌈·⌉ also covers underflow.
        let error = up(products + 2.0 * gamma(depth) * spread, n + 5);
        let value = Interval::point(along_c) + Interval::point(spread);
        let bounds = (value - error).hull(&(value + error));
        if bounds.is_finite() {
            Ok(bounds)
        } else {
            Err(SetError::NotFinite {
                op: OP,
                value: bounds.mag(),
            })
        }
    }

    /// Whether the set contains the point that the box `x` holds.
    ///
    /// `Outside` if the box lies outside the interval hull, in any dimension. In one dimension the hull
    /// is the set, in two the half-spaces of its edges are, so there the answer is `Undecided` only
    /// within rounding of the boundary. In higher dimensions projections look for a proof of
    /// either, and a point near the boundary may stay `Undecided`: deciding it takes a linear program.
    ///
    /// Fails with `Dimension`.
    pub fn contains(&self, x: &[Interval]) -> Result<Containment, SetError> {
        same("containment", self.dim(), x.len())?;
        let outer = self.radius();
        let offset: List<Interval> = x.iter().zip(&self.c).map(|(&x, &c)| x - c).collect();
        if offset.iter().zip(&outer).any(|(o, &r)| o.mig() > r) {
            return Ok(Containment::Outside);
        }
        Ok(match self.dim() {
            1 if offset[0].mag() <= self.least_radius(0) => Containment::Inside,
            2 => self.contains_planar(&offset),
            1 => Containment::Undecided,
            _ => self.contains_by_projection(&offset),
        })
    }

    /// A lower bound on |G|_i 1 + r_i.
    fn least_radius(&self, i: usize) -> f64 {
        let depth = self.generators() / 8 + 5;
        let sum = abs_sum(self.g.row(i)) + self.r[i];
        // Sums of subnormal numbers are exact, so no absolute term is needed; a sum of one term is exact
        // too, and then a point on the boundary of a given box counts as inside.
        let terms = self.g.row(i).iter().filter(|&&x| x != 0.0).count();
        if terms + usize::from(self.r[i] != 0.0) <= 1 {
            sum
        } else {
            // A sum that overflows had reached MAX before its roundings, which γ bounds.
            let sum = sum.min(f64::MAX);
            (sum * (1.0 - 2.0 * gamma(depth))).next_down().max(0.0)
        }
    }
}

/// `Dimension` unless `got` = `expected`.
fn same(op: &'static str, expected: usize, got: usize) -> Result<(), SetError> {
    if expected == got {
        Ok(())
    } else {
        Err(SetError::Dimension { op, expected, got })
    }
}

/// ⌈|G| 1⌉.
fn abs_row_sums_up(g: &Matrix) -> List<f64> {
    let depth = g.cols() / 8 + 4;
    let mut sums = g.abs_row_sums();
    sums.iter_mut().for_each(|s| *s = up(*s, depth));
    sums
}

/// The columns of diag(r) that are not zero.
fn box_columns(r: &[f64]) -> Matrix {
    let rows: List<usize> = (0..r.len()).filter(|&i| r[i] != 0.0).collect();
    let mut columns = Matrix::zeros(r.len(), rows.len());
    for (j, &i) in rows.iter().enumerate() {
        columns[(i, j)] = r[i];
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zonotope(c: &[f64], rows: &[&[f64]]) -> Zonotope {
        Zonotope::new(c.to_vec(), Matrix::from_rows(rows).unwrap()).unwrap()
    }

    #[test]
    fn hull_and_support_of_a_small_zonotope() {
        let z = zonotope(&[1.0, -1.0], &[&[1.0, 2.0], &[0.5, -1.0]]);
        let hull = z.interval_hull().unwrap();
        for (side, (lo, hi)) in hull.iter().zip([(-2.0, 4.0), (-2.5, 0.5)]) {
            assert!(side.lo() <= lo && side.lo() > lo - 1e-13, "{side:?}");
            assert!(side.hi() >= hi && side.hi() < hi + 1e-13, "{side:?}");
        }
        // ρ(1, 1) = 0 + |1.5| + |1|
        let support = z.support_bounds(&[1.0, 1.0]).unwrap();
        assert!(
            support.contains(2.5) && support.width() < 1e-13,
            "{support:?}"
        );
    }

    #[test]
    fn shapes_and_values_are_checked() {
        let g = || Matrix::zeros(2, 1);
        let dimension = |e| matches!(e, Err(SetError::Dimension { .. }));
        assert!(dimension(Zonotope::new(vec![0.0], g())));
        assert!(dimension(Zonotope::new(vec![], Matrix::zeros(0, 0))));
        assert!(dimension(Zonotope::with_rounding(
            vec![0.0; 2],
            g(),
            vec![0.0]
        )));
        assert!(matches!(
            Zonotope::new(vec![0.0, f64::NAN], g()),
            Err(SetError::NotFinite { .. })
        ));
        assert!(matches!(
            Zonotope::with_rounding(vec![0.0; 2], g(), vec![0.0, -1.0]),
            Err(SetError::Range { got: -1.0, .. })
        ));
        let z = zonotope(&[0.0], &[&[1.0]]);
        assert!(z.support(&[1.0, 0.0]).is_err());
        assert!(z.support(&[f64::INFINITY]).is_err());
        assert!(z.contains(&[]).is_err());
    }

    #[test]
    fn folding_turns_the_rounding_box_into_generators() {
        let z = Zonotope::with_rounding(vec![0.0; 2], Matrix::zeros(2, 0), vec![0.0, 0.5]).unwrap();
        let folded = z.fold();
        assert_eq!(folded.g(), &Matrix::column(&[0.0, 0.5]));
        assert_eq!(folded.r(), [0.0, 0.0]);
    }

    #[test]
    fn a_box_gives_a_zonotope_with_that_hull() {
        let sides = IntervalVector::from_bounds(&[-1.0, 0.1], &[3.0, 0.3]).unwrap();
        let z = Zonotope::from_box(&sides).unwrap();
        let hull = z.interval_hull().unwrap();
        assert!(hull.contains_box(&sides));
        assert!(
            hull.iter()
                .zip(sides.iter())
                .all(|(h, s)| h.width() < s.width() + 1e-14)
        );
    }

    #[test]
    fn one_dimension_is_decided_and_three_away_from_the_boundary() {
        let z = zonotope(&[1.0], &[&[0.5, 0.25]]);
        let at = |x: f64| z.contains(&[Interval::point(x)]).unwrap();
        assert_eq!(at(1.7), Containment::Inside);
        assert_eq!(at(1.8), Containment::Outside);
        assert_eq!(at(1.75), Containment::Undecided);
        let cube = Zonotope::new(vec![0.0; 3], Matrix::identity(3)).unwrap();
        let point = |x: f64| cube.contains(&[Interval::point(x); 3]).unwrap();
        assert_eq!(point(0.5), Containment::Inside);
        assert_eq!(point(1.0), Containment::Undecided);
        assert_eq!(point(1.5), Containment::Outside);
    }

    #[test]
    fn the_f_radius_depends_on_the_list_of_generators() {
        assert_eq!(zonotope(&[0.0], &[&[1.0, 1.0]]).trace_ggt(), 2.0);
        assert_eq!(zonotope(&[0.0], &[&[2.0]]).trace_ggt(), 4.0);
    }
}
