//! The point h that an expansion is made about.

use serde::{Deserialize, Serialize};
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::{
    ConstrainedZonotope, Containment, Interval, IntervalVector, List, Matrix, SetError, units,
};

/// How h is chosen, X̄ being X with all constraints eliminated and c̄ its center.
///
/// No choice needs to succeed for an enclosure to hold: derivatives are taken over the hull of X and h. "Closest" is meant by
/// the sum of the components' distances and the Θ_j of C2 add derivatives of different components: both depend on the
/// components' units.
///
/// Source: [Rego2020, Sec. 4.3] for C1 to C4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Choice {
    /// The center of the interval hull, or the point of X closest to it.
    C1,
    /// The point of X that minimises Σ_j Θ_j |c̄_j − h_j|, Θ_j = Σ_i diam J_ij: Eq. (21).
    C2,
    /// The point of X closest to c.
    C3,
    /// c if it lies in X; else, in the first-order expansion, X is rewritten around the point of C1
    /// (Prop. 2), and that point is h.
    C4,
    /// X is rewritten as X̄ ∩ X, and h is c̄ or the point of X closest to it. Not in the paper.
    Xb,
    /// c if it lies in X, else `xb`. Not in the paper.
    C4xb,
}

impl Choice {
    /// h for `x` with interval hull `hull`. `free` gives c̄, the center of X̄, `weights` the Θ of C2.
    pub(super) fn point(
        self,
        x: &ConstrainedZonotope,
        hull: &IntervalVector,
        free: impl FnOnce() -> Result<List<f64>, SetError>,
        weights: impl FnOnce() -> Result<List<f64>, SetError>,
        lp: &mut LinearProgram,
    ) -> Result<List<f64>, SetError> {
        match self {
            Self::C1 => nearest(x, &hull.mid(), lp),
            Self::C2 => closest_point(x, &free()?, Some(&weights()?), lp),
            Self::C3 => closest_point(x, x.c(), None, lp),
            Self::C4 if has(x, x.c(), lp)? => Ok(List::from(x.c())),
            Self::C4 => nearest(x, &hull.mid(), lp),
            Self::C4xb if has(x, x.c(), lp)? => Ok(List::from(x.c())),
            Self::Xb | Self::C4xb => nearest(x, &free()?, lp),
        }
    }
}

/// Whether the point lies in the set, up to 10⁻¹² of the set's extent: a choice, not a verdict.
pub(super) fn has(
    x: &ConstrainedZonotope,
    point: &[f64],
    lp: &mut LinearProgram,
) -> Result<bool, SetError> {
    if x.constraints() == 0 && x.c() == point {
        return Ok(true);
    }
    let radius = x.zonotope().radius();
    let near = point
        .iter()
        .zip(&radius)
        .map(|(&p, &r)| Interval::from_center_radius(p, 1e-12 * (p.abs() + r)));
    let near: List<Interval> = near.collect();
    Ok(x.contains_with(&near, lp)? != Containment::Outside)
}

/// The point itself if the set has it, else the closest one.
pub(super) fn nearest(
    x: &ConstrainedZonotope,
    point: &[f64],
    lp: &mut LinearProgram,
) -> Result<List<f64>, SetError> {
    if has(x, point, lp)? {
        Ok(List::from(point))
    } else {
        closest_point(x, point, None, lp)
    }
}

/// A point of `x` that minimises Σ_j Θ_j |p_j − h_j|, Θ = 1 unless given, up to rounding.
///
/// With |p_j − c_j − G_j ξ| = R_j (η⁺_j + η⁻_j)/2 + const it is one program over the box: maximise
/// −Σ Θ_j R_j (η⁺_j + η⁻_j)/2 over G_j ξ + R_j (η⁺_j − η⁻_j)/2 = p_j − c_j, A ξ = b, where R_j reaches from p
/// to everywhere in ⟨c, G⟩. Not a certified minimiser: nothing may depend on it. The distance adds components, so that it
/// depends on their units.
///
/// Fails with `Dimension`, `NotFinite`, or `Empty` if `x` is proved empty.
///
/// Source: [Rego2020, Prop. 1 and Eq. (21)].
pub fn closest_point(
    x: &ConstrainedZonotope,
    p: &[f64],
    weights: Option<&[f64]>,
    lp: &mut LinearProgram,
) -> Result<List<f64>, SetError> {
    let (n, q, g) = (x.dim(), x.constraints(), x.generators());
    if p.len() != n {
        return Err(SetError::Dimension {
            op: "closest point",
            expected: n,
            got: p.len(),
        });
    }
    let radius = x.zonotope().radius();
    let reach: List<f64> = (0..n)
        .map(|j| (p[j] - x.c()[j]).abs() + radius[j])
        .collect();
    let rows = Matrix::from_fn(n + q, g + 2 * n, |i, j| match (i < n, j < g) {
        (true, true) => x.g()[(i, j)],
        (true, false) if (j - g) / 2 == i => {
            0.5 * reach[i] * if (j - g) % 2 == 0 { 1.0 } else { -1.0 }
        }
        (false, true) => x.a()[(i - n, j)],
        _ => 0.0,
    });
    let right: List<f64> = (0..n)
        .map(|j| p[j] - x.c()[j])
        .chain(x.b().iter().copied())
        .collect();
    let slack = List::concat(&[x.r(), x.delta()]);
    let weight = |j: usize| weights.map_or(1.0, |w| w[j]) * reach[j];
    let largest = (0..n).map(weight).fold(f64::MIN_POSITIVE, f64::max);
    let mut cost = List::filled(0.0, g + 2 * n);
    for j in 0..n {
        cost[g + 2 * j] = -weight(j) / largest;
        cost[g + 2 * j + 1] = -weight(j) / largest;
    }
    lp.load(&rows, &right, &slack)?;
    let at = |xi: &[f64]| {
        let offset = x.g().mul_vec(xi);
        x.c().iter().zip(&offset).map(|(c, o)| c + o).collect()
    };
    match lp.maximize(&cost) {
        // R and p − c are rounded, so that this program may be empty and the set is not.
        Err(SetError::Empty { op }) => match x.emptiness() {
            Emptiness::Empty => Err(SetError::Empty { op }),
            Emptiness::NonEmpty(xi) => Ok(at(&xi)),
            Emptiness::Undecided { .. } => Ok(List::from(x.c())),
        },
        Err(other) => Err(other),
        Ok(_) => Ok(at(&lp.point()[..g])),
    }
}

/// m with c + G m = h (up to rounding) that keeps the half-widths of [m_j ± ρ_j] ⊇ E_j small: the least
/// Σ_j |m_j − mid E_j|.
///
/// With m = mid E + R (η⁺ − η⁻)/2: maximise −Σ (η⁺_j + η⁻_j) over G R (η⁺ − η⁻)/2 = h − c − G mid E, R the
/// 1-norm of the solution of least 2-norm. Where G has rows that depend on each other, h may be off them by a
/// rounding and the program have no solution; then m = mid E: any m is right, this one is only wider.
///
/// Source: [Rego2020, Prop. 2]: its program minimises ½ Σ (ξᵁ − ξᴸ) over boxes [ξᴸ, ξᵁ] ⊇ E of middle m.
pub fn coordinates_of(
    x: &ConstrainedZonotope,
    h: &[f64],
    ranges: &[Interval],
    lp: &mut LinearProgram,
) -> Result<List<f64>, SetError> {
    let (n, p) = (x.dim(), x.generators());
    let mut m: List<f64> = ranges.iter().map(|e| e.mid()).collect();
    let moved = x.g().mul_vec(&m);
    let right: List<f64> = (0..n).map(|i| h[i] - x.c()[i] - moved[i]).collect();
    // In units of the rows: the least solution is the same, its rounding depends on no unit.
    let units = units::of_rows(x.g());
    let inverse = units::divided_rows(x.g(), &units).pseudo_inverse()?;
    let scaled: List<f64> = right.iter().zip(&units).map(|(x, u)| x / u).collect();
    let shortest = inverse.mul_vec(&scaled);
    let reach = 1.01 * shortest.iter().map(|x| x.abs()).sum::<f64>();
    if reach == 0.0 {
        return Ok(m);
    }
    let rows = Matrix::from_fn(n, 2 * p, |i, j| {
        let sign = if j % 2 == 0 { 0.5 } else { -0.5 };
        sign * reach * x.g()[(i, j / 2)]
    });
    lp.load(&rows, &right, &List::filled(0.0, n))?;
    match lp.maximize(&List::filled(-1.0, 2 * p)) {
        Err(SetError::Empty { .. }) => return Ok(m),
        solved => solved?,
    };
    let eta = lp.point();
    for (j, m) in m.iter_mut().enumerate() {
        *m += 0.5 * reach * (eta[2 * j] - eta[2 * j + 1]);
    }
    Ok(m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(g: &[[f64; 2]], a: &[[f64; 2]], b: &[f64]) -> ConstrainedZonotope {
        let a = match a {
            [] => Matrix::zeros(0, 2),
            a => Matrix::from_rows(a).unwrap(),
        };
        ConstrainedZonotope::new(
            vec![0.0; g.len()],
            Matrix::from_rows(g).unwrap(),
            a,
            b.to_vec(),
        )
        .unwrap()
    }

    /// Two rows that say the same, and a point that is off one of them by less than a rounding of the set.
    #[test]
    fn coordinates_of_a_point_beside_a_flat_set_are_no_proof_of_emptiness() {
        let flat = set(&[[1.0, 0.5], [1.0, 0.5]], &[], &[]);
        let ranges = [Interval::new(-1.0, 1.0).unwrap(); 2];
        let mut lp = LinearProgram::new();
        let m = coordinates_of(&flat, &[0.25, 0.25 + 1e-9], &ranges, &mut lp).unwrap();
        assert_eq!(m, [0.0, 0.0]);
        let m = coordinates_of(&flat, &[0.25, 0.25], &ranges, &mut lp).unwrap();
        assert!((m[0] + 0.5 * m[1] - 0.25).abs() < 1e-12, "{m:?}");
    }

    #[test]
    fn the_closest_point_of_an_empty_set_is_an_error_and_of_a_single_point_is_it() {
        let square = [[1.0, 0.0], [0.0, 1.0]];
        let mut lp = LinearProgram::new();
        let empty = set(&square, &[[1.0, 1.0]], &[2.5]);
        let outcome = closest_point(&empty, &[0.0, 0.0], None, &mut lp);
        assert!(
            matches!(outcome, Err(SetError::Empty { .. })),
            "{outcome:?}"
        );
        let corner = set(&square, &[[1.0, 1.0]], &[2.0]);
        let point = closest_point(&corner, &[-1.0, -1.0], None, &mut lp).unwrap();
        assert!(point.iter().all(|x| (x - 1.0).abs() < 1e-9), "{point:?}");
    }
}
