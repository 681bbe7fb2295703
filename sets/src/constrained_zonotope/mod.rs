//! Constrained zonotopes that carry their own rounding, with proved answers.
//!
//! ⟨c, G, A, b, r, δ⟩ = { c + G ξ + s : |ξ| ≤ 1, |A ξ − b| ≤ δ, |s| ≤ r }: a zonotope ⟨c, G, r⟩ whose
//! generators are tied by q equations, each known up to a slack δ_i. Given data have r = 0 and δ = 0;
//! every operation adds to them what its own rounding may have cost, so the result contains the exact
//! result for the f64 coefficients that came in. r is scratch within a step
//! ([`ConstrainedZonotope::fold`]); δ stays at rounding level and is absorbed by the linear programs.
//!
//! Here are the set itself and what is asked of it through [`LinearProgram`]: hull, support, membership,
//! emptiness. `map` has the operations that make new sets, `planar` and `spatial` the vertices and volume
//! in two and three dimensions.
//!
//! Source: J. K. Scott, D. M. Raimondo, G. R. Marseglia, R. D. Braatz, "Constrained zonotopes: a new tool
//! for set-based estimation and fault detection", Automatica 2016; as used in \[Rego2020\].

mod map;
mod planar;
mod spatial;

use crate::lp::{Emptiness, LinearProgram};
use crate::rounding::{ETA, gamma, up};
use crate::{Containment, Interval, IntervalVector, List, Matrix, SetError, Zonotope};

/// The constrained zonotope ⟨c, G, A, b, r, δ⟩.
///
/// # Laws
///
/// Those of [`Zonotope`] hold, up to the rounding that r, δ and the certified bounds account for, and
/// moreover, for Y and a matrix R:
///
/// - x ∈ X and R x ∈ Y give x ∈ X ∩_R Y, and X ∩_R Y ⊆ X;
/// - the hull of X lies in the hull of ⟨c, G, r⟩;
/// - no operation reports `Empty` for a set that has a point.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstrainedZonotope {
    z: Zonotope,
    a: Matrix,
    b: List<f64>,
    delta: List<f64>,
}

impl ConstrainedZonotope {
    /// ⟨c, G, A, b, 0, 0⟩ with G n × p, A q × p.
    ///
    /// `a` must have p columns also when it has no rows. Fails with `Dimension` if shapes differ or
    /// n = 0, with `NotFinite` at a NaN or infinite entry.
    pub fn new(
        c: impl Into<List<f64>>,
        g: Matrix,
        a: Matrix,
        b: impl Into<List<f64>>,
    ) -> Result<Self, SetError> {
        let b = b.into();
        let delta = List::filled(0.0, b.len());
        Self::with_slack(Zonotope::new(c, g)?, a, b, delta)
    }

    /// { z : |A ξ − b| ≤ δ } for the generators' coordinates ξ of `z`.
    ///
    /// As [`ConstrainedZonotope::new`]; fails with `Range` if an entry of δ is negative.
    pub fn with_slack(
        z: Zonotope,
        a: Matrix,
        b: impl Into<List<f64>>,
        delta: impl Into<List<f64>>,
    ) -> Result<Self, SetError> {
        const OP: &str = "constrained zonotope";
        let (b, delta) = (b.into(), delta.into());
        same(OP, z.generators(), a.cols())?;
        for got in [b.len(), delta.len()] {
            same(OP, a.rows(), got)?;
        }
        if let Some(&got) = delta.iter().find(|&&x| x < 0.0) {
            return Err(SetError::Range {
                op: OP,
                what: "constraint slack",
                expected: "nonnegative",
                got,
            });
        }
        Self::checked(OP, z, a, b, delta)
    }

    /// The parts as the result of `op`, shapes known to fit; an overflow becomes `NotFinite`.
    pub(crate) fn checked(
        op: &'static str,
        z: Zonotope,
        a: Matrix,
        b: impl Into<List<f64>>,
        delta: impl Into<List<f64>>,
    ) -> Result<Self, SetError> {
        let (b, delta) = (b.into(), delta.into());
        match a
            .as_slice()
            .iter()
            .chain(&b)
            .chain(&delta)
            .find(|x| !x.is_finite())
        {
            Some(&value) => Err(SetError::NotFinite { op, value }),
            None => Ok(Self { z, a, b, delta }),
        }
    }

    /// A constrained zonotope that contains the box, without constraints: [`Zonotope::from_box`].
    pub fn from_box(sides: &IntervalVector) -> Result<Self, SetError> {
        Ok(Zonotope::from_box(sides)?.into())
    }

    /// The set of the one point `x`.
    pub fn point(x: &[f64]) -> Result<Self, SetError> {
        Ok(Zonotope::point(x)?.into())
    }

    /// n.
    #[inline]
    pub fn dim(&self) -> usize {
        self.z.dim()
    }

    /// p, the number of generators.
    #[inline]
    pub fn generators(&self) -> usize {
        self.z.generators()
    }

    /// q, the number of constraints.
    #[inline]
    pub fn constraints(&self) -> usize {
        self.b.len()
    }

    /// The center c of the generators; it need not lie in the set.
    #[inline]
    pub fn c(&self) -> &[f64] {
        self.z.c()
    }

    /// The generators G, n × p.
    #[inline]
    pub fn g(&self) -> &Matrix {
        self.z.g()
    }

    /// The constraints' coefficients A, q × p.
    #[inline]
    pub fn a(&self) -> &Matrix {
        &self.a
    }

    /// The constraints' right side b.
    #[inline]
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// The half-widths r of the rounding box.
    #[inline]
    pub fn r(&self) -> &[f64] {
        self.z.r()
    }

    /// The slack δ of the constraints.
    #[inline]
    pub fn delta(&self) -> &[f64] {
        &self.delta
    }

    /// ⟨c, G, r⟩: the zonotope without its constraints, which contains the set.
    #[inline]
    pub fn zonotope(&self) -> &Zonotope {
        &self.z
    }

    /// The same set with the rounding box and the slack made generators, exact:
    /// ⟨c, [G, diag(r), 0], [A, 0, diag(δ)], b, 0, 0⟩.
    ///
    /// Zero entries give no column. To be called once a step, before the order is reduced. Both would grow
    /// without need if they were carried on as boxes: r under maps that turn, δ under row operations, where
    /// |λ| δ adds up although the rows' errors cancel.
    pub fn fold(self) -> Self {
        let (n, p, q) = (self.dim(), self.generators(), self.constraints());
        let z = self.z.fold();
        let slack: List<usize> = (0..q).filter(|&i| self.delta[i] != 0.0).collect();
        if slack.is_empty() {
            let a = widened(self.a, z.generators());
            return Self {
                z,
                a,
                b: self.b,
                delta: self.delta,
            };
        }
        let first = z.generators();
        let cols = first + slack.len();
        let g = Matrix::from_fn(n, cols, |i, j| if j < first { z.g()[(i, j)] } else { 0.0 });
        let a = Matrix::from_fn(q, cols, |i, j| {
            if j < p {
                self.a[(i, j)]
            } else if j >= first && slack[j - first] == i {
                self.delta[i]
            } else {
                0.0
            }
        });
        let z = Zonotope::checked("fold", z.c(), g, List::filled(0.0, n));
        let z = z.expect("the entries are those of the set, which are finite");
        Self {
            z,
            a,
            b: self.b,
            delta: List::filled(0.0, q),
        }
    }

    /// The same set with its rounding box made wider by `more`: { x + s : |s| ≤ more }.
    ///
    /// Fails with `Dimension`, or `NotFinite` on overflow; `more` is taken by its absolute values.
    pub fn widened_by(self, more: &[f64]) -> Result<Self, SetError> {
        same("widening of a constrained zonotope", self.dim(), more.len())?;
        let sum = |(&r, m): (&f64, &f64)| match (r == 0.0, *m == 0.0) {
            (_, true) => r,
            (true, false) => m.abs(),
            _ => up(r + m.abs(), 1),
        };
        let r: List<f64> = self.r().iter().zip(more).map(sum).collect();
        let z = Zonotope::with_rounding(self.c(), self.g().clone(), r)?;
        Ok(Self { z, ..self })
    }

    /// The Minkowski sum with the box |x| ≤ `sides`: n generators more, no row of A touched; exact.
    ///
    /// Fails with `Dimension` or `NotFinite`.
    pub fn plus_box(self, sides: &[f64]) -> Result<Self, SetError> {
        same(
            "sum of a constrained zonotope and a box",
            self.dim(),
            sides.len(),
        )?;
        let g = Matrix::hcat(&[self.g(), &Matrix::diagonal(sides)]);
        let z = Zonotope::with_rounding(self.c(), g, self.r())?;
        let a = widened(self.a, z.generators());
        Ok(Self {
            z,
            a,
            b: self.b,
            delta: self.delta,
        })
    }

    /// Loads the constraints into `lp`.
    pub(crate) fn load(&self, lp: &mut LinearProgram) -> Result<(), SetError> {
        lp.load(&self.a, &self.b, &self.delta)
    }

    /// The smallest box that contains the set, as far as it can be proved. See
    /// [`ConstrainedZonotope::interval_hull_with`].
    pub fn interval_hull(&self) -> Result<IntervalVector, SetError> {
        self.interval_hull_with(&mut LinearProgram::new())
    }

    /// A box that contains the set: 2n linear programs over one feasible set, each bound certified.
    ///
    /// Side j is [c_j − U(−G_j) − r_j, c_j + U(G_j) + r_j], rounded outward, with U the certified upper
    /// bound; it is the smallest box up to rounding when the programs reach their optimum. The buffers
    /// of `lp` are used again.
    ///
    /// Fails with `Empty` if the set is proved empty: by a Farkas vector, or because a certified upper
    /// bound lies below a certified lower one.
    pub fn interval_hull_with(&self, lp: &mut LinearProgram) -> Result<IntervalVector, SetError> {
        const OP: &str = "interval hull of a constrained zonotope";
        if self.constraints() == 0 {
            return self.z.interval_hull();
        }
        let _stage = crate::ops::stage(crate::ops::Stage::Hull);
        self.load(lp)?;
        let mut minus = List::filled(0.0, self.generators());
        let mut sides = List::with_capacity(self.dim());
        for j in 0..self.dim() {
            let row = self.g().row(j);
            let upper = empty_in(OP, lp.maximize(row))?.upper;
            minus.iter_mut().zip(row).for_each(|(m, g)| *m = -g);
            let lower = empty_in(OP, lp.maximize(&minus))?.upper;
            let (c, r) = (self.c()[j], self.r()[j]);
            let hi = (Interval::point(c) + Interval::point(upper) + Interval::point(r)).hi();
            let lo = (Interval::point(c) - Interval::point(lower) - Interval::point(r)).lo();
            sides.push(match Interval::new(lo, hi) {
                Err(SetError::Reversed { .. }) => return Err(SetError::Empty { op: OP }),
                Err(SetError::NotFinite { value, .. }) => {
                    return Err(SetError::NotFinite { op: OP, value });
                }
                side => side?,
            });
        }
        Ok(IntervalVector::new(sides))
    }

    /// An upper bound on the support ρ(d) = max { dᵀx : x in the set }. See
    /// [`ConstrainedZonotope::support_with`].
    pub fn support(&self, d: &[f64]) -> Result<f64, SetError> {
        self.support_with(d, &mut LinearProgram::new())
    }

    /// A certified upper bound on ρ(d) = max { dᵀx : x in the set } = dᵀc + max (Gᵀd)ᵀξ + |d|ᵀr.
    ///
    /// γ_n |d|ᵀ(|c| + |G| 1) is added for the rounding of dᵀc and Gᵀd. Fails with `Dimension`,
    /// `NotFinite`, or `Empty` if the set is proved empty.
    pub fn support_with(&self, d: &[f64], lp: &mut LinearProgram) -> Result<f64, SetError> {
        self.load(lp)?;
        self.support_loaded(d, lp)
    }

    /// The support in many directions, with one start of the linear program.
    ///
    /// Fails as [`ConstrainedZonotope::support_with`].
    pub fn supports<D: AsRef<[f64]>>(&self, directions: &[D]) -> Result<Vec<f64>, SetError> {
        let mut lp = LinearProgram::new();
        self.load(&mut lp)?;
        directions
            .iter()
            .map(|d| self.support_loaded(d.as_ref(), &mut lp))
            .collect()
    }

    /// The support, the constraints being in `lp` already.
    pub(crate) fn support_loaded(
        &self,
        d: &[f64],
        lp: &mut LinearProgram,
    ) -> Result<f64, SetError> {
        const OP: &str = "support of a constrained zonotope";
        let n = self.dim();
        same(OP, n, d.len())?;
        if let Some(&value) = d.iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        let row = Matrix::from_fn(1, n, |_, i| d[i]);
        let along_c = row.mul_vec(self.c())[0];
        let along_g = empty_in(OP, lp.maximize(row.mul(self.g()).row(0)))?.upper;
        let sums = self.z.abs_row_sums();
        let rest: f64 = (0..n)
            .map(|i| d[i].abs() * (self.r()[i] + gamma(n) * (self.c()[i].abs() + sums[i]) + ETA))
            .sum();
        let bound =
            Interval::point(along_c) + Interval::point(along_g) + Interval::point(up(rest, n + 4));
        let bound = bound.hi();
        if bound.is_finite() {
            Ok(bound)
        } else {
            Err(SetError::NotFinite {
                op: OP,
                value: bound,
            })
        }
    }

    /// Whether the set is empty: proved empty, proved to hold a point, or undecided with a margin.
    ///
    /// `NonEmpty` carries ξ; the claim is about the set whose slack is δ + σ with the σ of
    /// [`Emptiness::NonEmpty`], a few roundings of the row.
    pub fn emptiness(&self) -> Emptiness {
        let mut lp = LinearProgram::new();
        match self.load(&mut lp) {
            Ok(()) => lp.emptiness(),
            Err(_) => Emptiness::Undecided {
                margin: f64::INFINITY,
            },
        }
    }

    /// Whether the set contains the point that the box `x` holds.
    ///
    /// The rows |G ξ − (x − c)| ≤ r and |A ξ − b| ≤ δ are decided by [`LinearProgram::emptiness`]:
    /// `Outside` if no ξ meets them for any point of the box, `Inside` if a ξ was verified to meet them for
    /// each of its points, each row up to σ_i = 2γ_{p+2}(|row|1 + |right side|): the verdict is about
    /// the set with that slack, since no f64 solves an equation exactly. It is one ξ for all of a box
    /// within r, else a ξ that moves with the point (`contains_deeply`).
    ///
    /// Fails with `Dimension`, or `NotFinite` if `x` is unbounded.
    pub fn contains(&self, x: &[Interval]) -> Result<Containment, SetError> {
        self.contains_with(x, &mut LinearProgram::new())
    }

    /// As [`ConstrainedZonotope::contains`], with the buffers of `lp`.
    pub fn contains_with(
        &self,
        x: &[Interval],
        lp: &mut LinearProgram,
    ) -> Result<Containment, SetError> {
        const OP: &str = "containment in a constrained zonotope";
        let n = self.dim();
        same(OP, n, x.len())?;
        if let Some(side) = x.iter().find(|side| !side.is_finite()) {
            return Err(SetError::NotFinite {
                op: OP,
                value: side.mag(),
            });
        }
        let (mut right, mut slack, mut reserve) = (List::new(), List::new(), List::new());
        for (i, &side) in x.iter().enumerate() {
            let offset = side - self.c()[i];
            // Every x − c lies within `radius` of the middle, the rounding of the difference included.
            let radius = offset.rad();
            right.push(offset.mid());
            slack.push(if radius == 0.0 {
                self.r()[i]
            } else {
                up(self.r()[i] + radius, 1)
            });
            reserve.push(2.0 * radius);
        }
        right.extend_from_slice(&self.b);
        slack.extend_from_slice(&self.delta);
        let rows = Matrix::vcat(&[self.g(), &self.a]);
        let radius: List<f64> = reserve.iter().map(|r| 0.5 * r).collect();
        if radius.iter().zip(self.r()).any(|(radius, r)| radius > r)
            && self.contains_deeply(&rows, &right, &radius, lp)?
        {
            return Ok(Containment::Inside);
        }
        let mut found = point_keeping(&rows, &right, &slack, &reserve, lp)?;
        if matches!(found, Emptiness::Undecided { .. }) {
            found = lp.emptiness_by_second_opinion(&reserve);
        }
        Ok(match found {
            Emptiness::Empty => Containment::Outside,
            Emptiness::NonEmpty(_) => Containment::Inside,
            Emptiness::Undecided { .. } => Containment::Undecided,
        })
    }
}

/// Whether some ξ keeps |rows ξ − right| + reserve ≤ slack, by the simplex alone: first among the vertices within the
/// slack, where a proof that there is none comes from too, then among those within what the reserve leaves of
/// it. A vertex is where some rows are at the end of their slack, so it seldom has a reserve by itself. Leaves the rows
/// with all of the slack in `lp`.
fn point_keeping(
    rows: &Matrix,
    right: &[f64],
    slack: &[f64],
    reserve: &[f64],
    lp: &mut LinearProgram,
) -> Result<Emptiness, SetError> {
    lp.load(rows, right, slack)?;
    let found = lp.point_with_reserve(reserve);
    if !matches!(found, Emptiness::Undecided { .. }) || reserve.iter().all(|r| *r == 0.0) {
        return Ok(found);
    }
    let kept = reserve.iter().copied().chain(std::iter::repeat(0.0));
    let left: List<f64> = slack
        .iter()
        .zip(kept)
        .map(|(slack, kept)| if *slack > kept { slack - kept } else { 0.0 })
        .collect();
    lp.load(rows, right, &left)?;
    let closer = lp.point_with_reserve(&[]);
    lp.load(rows, right, slack)?;
    Ok(match closer {
        Emptiness::NonEmpty(xi) if lp.verifies(&xi, reserve) => Emptiness::NonEmpty(xi),
        _ => found,
    })
}

impl ConstrainedZonotope {
    /// Whether every point x − c = m + s, |s| ≤ `radius`, of a box was proved to be in the set; `rows` is
    /// [G; A], `right` (m, b).
    ///
    /// With M an approximate right inverse of the rows, restricted to the first n of their right sides, and ξ
    /// a verified point for m, |ξ| ≤ 1 − ε, ε ≥ ‖|M| radius‖∞, the point ξ + M s meets the rows for m + s up to
    /// |rows M − [I; 0]| radius, which ξ keeps in reserve. Any M is right. A set much thinner in one
    /// direction than its own rounding box in another has no single ξ for a whole box.
    fn contains_deeply(
        &self,
        rows: &Matrix,
        right: &[f64],
        radius: &[f64],
        lp: &mut LinearProgram,
    ) -> Result<bool, SetError> {
        let (n, p) = (self.dim(), self.generators());
        let Some(inverse) = right_inverse(rows, n) else {
            return Ok(false);
        };
        let moved = inverse.abs().mul_vec(radius);
        // The product and the sum 1 − ε are rounded; a part in 10⁶ and 10⁻¹⁴ is more than that.
        let share = 1e-14 + 1.000001 * moved.iter().fold(0.0_f64, |m, x| m.max(*x));
        // NaN is not below.
        if !matches!(share.partial_cmp(&0.5), Some(std::cmp::Ordering::Less)) {
            return Ok(false);
        }
        let product = rows.mul(&inverse);
        let sizes = rows.abs().mul(&inverse.abs());
        let left: List<f64> = (0..rows.rows())
            .map(|i| {
                let defect = (0..n).map(|j| {
                    let identity = f64::from(u8::from(i == j));
                    let rounding = gamma(p + 3) * (sizes[(i, j)] + identity);
                    ((product[(i, j)] - identity).abs() + rounding) * radius[j]
                });
                up(defect.sum::<f64>(), n + 4)
            })
            .collect();
        let slack = List::concat(&[self.r(), &self.delta]);
        let within = 1.0 - share;
        let found = point_keeping(&rows.scale(within), right, &slack, &left, lp)?;
        let Emptiness::NonEmpty(mut xi) = found else {
            return Ok(false);
        };
        xi.iter_mut().for_each(|x| *x *= within);
        lp.load(rows, right, &slack)?;
        Ok(lp.verifies(&xi, &left))
    }
}

/// The first n columns of Bᵀ(B Bᵀ)⁻¹ for B = `rows`, rounded; `None` where the rows are dependent.
fn right_inverse(rows: &Matrix, n: usize) -> Option<Matrix> {
    let m = rows.rows();
    let norms: List<f64> = (0..m)
        .map(|i| rows.row(i).iter().fold(0.0, |s, x| s + x * x).sqrt())
        .collect();
    if norms.contains(&0.0) {
        return None;
    }
    let unit = Matrix::from_fn(m, rows.cols(), |i, j| rows[(i, j)] / norms[i]);
    let inverse = unit.gram().inverse().ok()?;
    let columns = Matrix::from_fn(m, n, |i, j| inverse[(i, j)] / norms[j]);
    Some(unit.transpose().mul(&columns))
}

impl From<Zonotope> for ConstrainedZonotope {
    fn from(z: Zonotope) -> Self {
        let a = Matrix::zeros(0, z.generators());
        Self {
            z,
            a,
            b: List::new(),
            delta: List::new(),
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

/// The result of a linear program, with `Empty` said of the operation `op`.
fn empty_in<T>(op: &'static str, result: Result<T, SetError>) -> Result<T, SetError> {
    result.map_err(|error| match error {
        SetError::Empty { .. } => SetError::Empty { op },
        other => other,
    })
}

/// A with zero columns appended up to `cols`; right also for an A without rows.
fn widened(a: Matrix, cols: usize) -> Matrix {
    if a.cols() == cols {
        return a;
    }
    Matrix::from_fn(
        a.rows(),
        cols,
        |i, j| if j < a.cols() { a[(i, j)] } else { 0.0 },
    )
}
