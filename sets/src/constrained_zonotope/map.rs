//! The operations that make new constrained zonotopes, with what their rounding adds to r and δ.
//!
//! Maps act on the zonotope ⟨c, G, r⟩ and leave the constraints alone; sums and products stack them;
//! an intersection adds one row a dimension of the other set. Notation as in the maps of zonotopes.
//!
//! Source: [Rego2020, Eqs. (3)–(6)], after Scott et al., Automatica 2016.

use super::{ConstrainedZonotope, same};
use crate::rounding::{ETA, U, gamma, up};
use crate::units::picked;
use crate::{Interval, List, Matrix, SetError, Zonotope};

impl ConstrainedZonotope {
    /// Encloses { M x : x ∈ X }, M m × n. See [`ConstrainedZonotope::affine_map`].
    pub fn linear_map(&self, m: &Matrix) -> Result<Self, SetError> {
        self.affine_map(m, &List::filled(0.0, m.rows()))
    }

    /// Encloses { M x + t : x ∈ X } = ⟨M c + t, M G, A, b⟩, M m × n, t in ℝᵐ.
    ///
    /// r grows as in [`Zonotope::affine_map`], which also says what fails.
    pub fn affine_map(&self, m: &Matrix, t: &[f64]) -> Result<Self, SetError> {
        Ok(Self {
            z: self.z.affine_map(m, t)?,
            ..self.clone()
        })
    }

    /// Encloses { x + t : x ∈ X }. Fails as [`Zonotope::translate`].
    pub fn translate(&self, t: &[f64]) -> Result<Self, SetError> {
        Ok(Self {
            z: self.z.translate(t)?,
            ..self.clone()
        })
    }

    /// Encloses X ⊕ Y = ⟨c + d, [G, H], diag(A, B), (a, b)⟩.
    ///
    /// Only c + d rounds. Fails as [`Zonotope::minkowski_sum`].
    pub fn minkowski_sum(&self, y: &Self) -> Result<Self, SetError> {
        Ok(self.stacked(y, self.z.minkowski_sum(&y.z)?))
    }

    /// X × Y = { (x, y) : x ∈ X, y ∈ Y }, exact.
    pub fn cartesian_product(&self, y: &Self) -> Self {
        self.stacked(y, self.z.cartesian_product(&y.z))
    }

    /// { (x_i, i in `which`) : x ∈ X }: the projection onto neighbouring components, exact.
    ///
    /// All generators and constraints stay. Fails with `Dimension` where X has not all the components.
    pub fn components(&self, which: std::ops::Range<usize>) -> Result<Self, SetError> {
        const OP: &str = "projection of a constrained zonotope";
        if which.end > self.dim() || which.start > which.end {
            return Err(SetError::Dimension {
                op: OP,
                expected: self.dim(),
                got: which.end,
            });
        }
        let g = Matrix::from_fn(which.len(), self.generators(), |i, j| {
            self.g()[(which.start + i, j)]
        });
        let (c, r) = (&self.c()[which.clone()], &self.r()[which]);
        Ok(Self {
            z: Zonotope::checked(OP, c, g, r)?,
            ..self.clone()
        })
    }

    /// `z`, whose generators are those of X and then those of Y, with the constraints of both.
    fn stacked(&self, y: &Self, z: Zonotope) -> Self {
        let (p, q) = (self.generators(), self.constraints());
        let a = Matrix::from_fn(q + y.constraints(), z.generators(), |i, j| {
            match (i < q, j < p) {
                (true, true) => self.a[(i, j)],
                (false, false) => y.a[(i - q, j - p)],
                _ => 0.0,
            }
        });
        Self {
            z,
            a,
            b: List::concat(&[&self.b[..], &y.b]),
            delta: List::concat(&[&self.delta[..], &y.delta]),
        }
    }

    /// Encloses X ∩ Y. See [`ConstrainedZonotope::generalized_intersection`].
    pub fn intersect(&self, y: &Self) -> Result<Self, SetError> {
        same("intersection of constrained zonotopes", self.dim(), y.dim())?;
        self.generalized_intersection(&Matrix::identity(self.dim()), y)
    }

    /// Encloses X ∩_R Y = { x ∈ X : R x ∈ Y }, R m × n, Y = ⟨d, H, B, b_y, r_y, δ_y⟩ in ℝᵐ.
    ///
    /// ⟨c, [G, 0], [A, 0; 0, B; fl(R G), −H], (b, b_y, fl(d − R c)), r⟩ with the slack of the new rows
    /// δ = ⌈|R| r + r_y + γ_{n+1}(|R| (|G| 1 + |c|) + |d|)⌉; where a row of R picks one component, times a power of
    /// two perhaps, R G is exact and only u |d − R c| is charged. The result may be empty: ask
    /// [`ConstrainedZonotope::emptiness`] or take its hull.
    ///
    /// Fails with `Dimension`, or `NotFinite` if R or the result is not finite.
    ///
    /// Source: [Rego2020, Eq. (5)].
    pub fn generalized_intersection(&self, r: &Matrix, y: &Self) -> Result<Self, SetError> {
        const OP: &str = "generalized intersection";
        let (n, m) = (self.dim(), y.dim());
        same(OP, n, r.cols())?;
        same(OP, m, r.rows())?;
        let (p, q) = (self.generators(), self.constraints());
        let top = q + y.constraints();
        let cols = p + y.generators();
        let rg = r.mul(self.g());
        let a = Matrix::from_fn(top + m, cols, |i, j| {
            if i < q {
                if j < p { self.a[(i, j)] } else { 0.0 }
            } else if i < top {
                if j < p { 0.0 } else { y.a[(i - q, j - p)] }
            } else if j < p {
                rg[(i - top, j)]
            } else {
                -y.g()[(i - top, j - p)]
            }
        });
        let (mut b, mut delta) = (
            List::concat(&[&self.b[..], &y.b]),
            List::concat(&[&self.delta[..], &y.delta]),
        );
        let sums = self.z.abs_row_sums();
        for (i, (&d, &rc)) in y.c().iter().zip(&r.mul_vec(self.c())).enumerate() {
            let right = d - rc;
            b.push(right);
            let exactly = picked(r.row(i)).filter(|&(k, a)| {
                let there = rg.row(i).iter().zip(self.g().row(k));
                there.chain([(&rc, &self.c()[k])]).all(|(y, x)| y / a == *x)
            });
            delta.push(match exactly {
                Some((k, a)) => {
                    let rounding = if d == 0.0 || rc == 0.0 {
                        0.0
                    } else {
                        U * right.abs()
                    };
                    let own = self.r()[k] * a.abs();
                    let own = if own / a.abs() == self.r()[k] {
                        own
                    } else {
                        up(own, 1)
                    };
                    exact_or_up([own, y.r()[i], rounding])
                }
                None => {
                    let row = r.row(i).iter().enumerate();
                    let carried: f64 = row
                        .map(|(k, x)| {
                            x.abs()
                                * (self.r()[k] + gamma(n + 1) * (sums[k] + self.c()[k].abs()) + ETA)
                        })
                        .sum();
                    up(carried + y.r()[i] + gamma(n + 1) * d.abs(), n + 6)
                }
            });
        }
        let g = Matrix::from_fn(n, cols, |i, j| if j < p { self.g()[(i, j)] } else { 0.0 });
        let z = Zonotope::checked(OP, self.c(), g, self.r())?;
        Self::checked(OP, z, a, b, delta)
    }

    /// Encloses { x ∈ X : |dᵀx − y| ≤ σ }: one row and one generator more.
    ///
    /// Fails with `Dimension`, `NotFinite`, or `Range` if σ < 0.
    pub fn intersect_strip(&self, d: &[f64], y: f64, sigma: f64) -> Result<Self, SetError> {
        const OP: &str = "intersection with a strip";
        same(OP, self.dim(), d.len())?;
        if sigma.is_nan() || sigma < 0.0 {
            return Err(SetError::Range {
                op: OP,
                what: "half-width",
                expected: "nonnegative",
                got: sigma,
            });
        }
        let strip = Zonotope::new(vec![y], Matrix::column(&[sigma]))?;
        self.generalized_intersection(&Matrix::from_rows(&[d])?, &strip.into())
    }

    /// Encloses { x ∈ X : dᵀx ≤ s }: the strip between −ρ(−d) of the zonotope ⟨c, G, r⟩ and s.
    ///
    /// Fails with `Dimension`, `NotFinite`, or `Empty` if the half-space misses that zonotope.
    pub fn intersect_halfspace(&self, d: &[f64], s: f64) -> Result<Self, SetError> {
        const OP: &str = "intersection with a half-space";
        let minus: List<f64> = d.iter().map(|x| -x).collect();
        let least = -self.z.support(&minus)?;
        let strip = match Interval::new(least, s) {
            Ok(strip) => strip,
            Err(SetError::Reversed { .. }) => return Err(SetError::Empty { op: OP }),
            Err(other) => return Err(other),
        };
        self.intersect_strip(d, strip.mid(), strip.rad())
    }
}

/// The sum of nonnegative terms: exact if at most one is not zero, else rounded up.
fn exact_or_up(terms: [f64; 3]) -> f64 {
    let sum = terms.iter().sum();
    if terms.iter().filter(|&&x| x != 0.0).count() <= 1 {
        sum
    } else {
        up(sum, 3)
    }
}
