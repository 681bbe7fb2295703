//! The intersection of a zonotope with a strip, as a zonotope: Bravo's choice of the smallest.
//!
//! Every x in the strip |dᵀx − y| ≤ σ equals (I − λ dᵀ) x + λ (y + σ ζ), |ζ| ≤ 1, for any vector λ. With
//! λ = g_j/(dᵀg_j) generator j drops out and σ λ takes its place, so the number of generators stays. Each j
//! gives one enclosure, the zonotope itself is another; the one with the least det(T Tᵀ) is taken.
//!
//! Source: J. M. Bravo, T. Alamo, E. F. Camacho, "Bounded error identification of systems with time-varying
//! parameters", IEEE TAC 2006; used in [Rego2020, Sec. 6] for ZMV and ZFO.

use crate::rounding::{ETA, U, gamma, up};
use crate::{Interval, List, Matrix, SetError, Zonotope, ops};

/// Encloses { x ∈ Z : |dᵀx − y| ≤ σ } in a zonotope of as many generators as Z has.
///
/// The strip is first narrowed to its intersection with dᵀc ± (|Gᵀd| 1 + |d|ᵀr), rounded outward, which
/// gives the y and σ used. Candidates are Z and, for each j with dᵀg_j ≠ 0, λ = g_j/(dᵀg_j):
/// c' = fl(c + λ e), e = fl(y − dᵀc), columns fl(g_i − λ (dᵀg_i)), and σ λ in place of g_j. Of equal
/// determinants the first is taken, Z before all.
///
/// r_i' = ⌈|I − λ dᵀ|_i r + γ_2 (|c_i| + |λ_i| |e|) + |λ_i| γ_{n+1} (|y| + |d|ᵀ|c|) + γ_2 |G_i| 1
///       + |λ_i| γ_{n+2} |d|ᵀ(|G| 1) + u |λ_i σ| + |g_ij − λ_i fl(dᵀg_j)|⌉; the last term is what is left of
/// column j.
///
/// Fails with `Dimension`, `NotFinite`, `Range` if σ < 0, or `Empty` if the strip misses Z.
pub fn intersect(z: &Zonotope, d: &[f64], y: f64, sigma: f64) -> Result<Zonotope, SetError> {
    const OP: &str = "intersection of a zonotope with a strip";
    let n = z.dim();
    if d.len() != n {
        return Err(SetError::Dimension {
            op: OP,
            expected: n,
            got: d.len(),
        });
    }
    if let Some(&value) = d.iter().chain([&y, &sigma]).find(|x| !x.is_finite()) {
        return Err(SetError::NotFinite { op: OP, value });
    }
    if sigma < 0.0 {
        return Err(SetError::Range {
            op: OP,
            what: "half-width",
            expected: "nonnegative",
            got: sigma,
        });
    }
    let minus: List<f64> = d.iter().map(|x| -x).collect();
    let extent = Interval::trusted(-z.support(&minus)?, z.support(d)?);
    let strip = Interval::from_center_radius(y, sigma);
    let Some(narrowed) = extent.intersect(&strip) else {
        return Err(SetError::Empty { op: OP });
    };
    // The middle of a strip that was not narrowed is y itself, without a rounding.
    let (y, sigma) = match narrowed == strip {
        true => (y, sigma),
        false => (narrowed.mid(), narrowed.rad()),
    };
    let along = Matrix::from_rows(&[d])?.mul(z.g());
    let along = along.row(0);
    match smallest(z.g(), along, sigma) {
        None => Ok(z.clone()),
        Some(j) => by_generator(OP, z, d, y, sigma, along, j),
    }
}

/// The generator whose enclosure has the least det(T Tᵀ), or `None` for the zonotope itself.
///
/// With S = G Gᵀ, q = Gᵀd and a = g_j/q_j, T_j T_jᵀ = S + \[a, Sd\] \[\[κ, −1\], \[−1, 0\]\] \[a, Sd\]ᵀ,
/// κ = dᵀSd + σ², so by the determinant lemma, with aᵀS⁻¹(Sd) = 1,
///
/// det(T_j T_jᵀ)/det S = σ² g_jᵀS⁻¹g_j/q_j²:
///
/// n² a candidate, and no difference of numbers that nearly agree. Generators in which a component is 10⁵
/// times smaller than in others (and rounding made a generator) leave nothing of a determinant computed
/// outright. A row that depends on those before it is left out of S.
fn smallest(g: &Matrix, q: &[f64], sigma: f64) -> Option<usize> {
    // Columns this much along the strip would be divided by rounding.
    let cut = 1e-12 * q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let squares = whitened_squares(g);
    let mut best = (1.0, None);
    let mut candidates = 0;
    for (j, (&q, &square)) in q.iter().zip(&squares).enumerate() {
        if q.abs() <= cut {
            continue;
        }
        candidates += 1;
        let ratio = sigma / q;
        let candidate = ratio * ratio * square;
        if candidate < best.0 {
            best = (candidate, Some(j));
        }
    }
    ops::count(3 * candidates, 0);
    best.1
}

/// g_jᵀS⁻¹g_j = ‖L⁻¹g_j‖² for L Lᵀ = S = G Gᵀ; a row of L without a pivot above rounding is left out.
fn whitened_squares(g: &Matrix) -> List<f64> {
    let (n, p) = (g.rows(), g.cols());
    let s = g.gram();
    let mut l = s.clone();
    let mut v: List<List<f64>> = List::with_capacity(n);
    let mut squares = List::filled(0.0, p);
    for i in 0..n {
        for k in 0..i {
            let rest = (0..k).fold(l[(i, k)], |r, m| r - l[(i, m)] * l[(k, m)]);
            let pivot = l[(k, k)];
            l[(i, k)] = if pivot > 0.0 { rest / pivot } else { 0.0 };
        }
        let rest = (0..i).fold(l[(i, i)], |r, m| r - l[(i, m)] * l[(i, m)]);
        // Row i of L, its root aside: k products and a quotient for each k < i, and i squares.
        ops::count(i * (i + 1) / 2 + i, i * i.saturating_sub(1) / 2 + i);
        if rest <= 1e-14 * s[(i, i)] {
            l[(i, i)] = 0.0;
            v.push(List::filled(0.0, p));
            continue;
        }
        let root = rest.sqrt();
        l[(i, i)] = root;
        let mut row = List::from(g.row(i));
        for (k, other) in v.iter().enumerate() {
            let f = l[(i, k)];
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= f * y);
        }
        for (x, square) in row.iter_mut().zip(&mut squares) {
            *x /= root;
            *square += *x * *x;
        }
        // The first square goes to a sum that has no term yet.
        ops::count(1 + p * (i + 2), p * (i + usize::from(i > 0)));
        v.push(row);
    }
    squares
}

/// The enclosure by λ = g_j/(dᵀg_j).
fn by_generator(
    op: &'static str,
    z: &Zonotope,
    d: &[f64],
    y: f64,
    sigma: f64,
    along: &[f64],
    j: usize,
) -> Result<Zonotope, SetError> {
    let n = z.dim();
    let lambda: List<f64> = (0..n).map(|i| z.g()[(i, j)] / along[j]).collect();
    let dc = d.iter().zip(z.c()).fold(0.0, |s, (d, c)| s + d * c);
    let e = y - dc;
    let c: List<f64> = z.c().iter().zip(&lambda).map(|(c, l)| c + l * e).collect();
    let sums = z.abs_row_sums();
    let abs_dc = d
        .iter()
        .zip(z.c())
        .fold(0.0, |s, (d, c)| s + d.abs() * c.abs());
    let abs_dg = d.iter().zip(&sums).fold(0.0, |s, (d, g)| s + d.abs() * g);
    let common = gamma(n + 1) * (y.abs() + abs_dc) + gamma(n + 2) * abs_dg + 2.0 * ETA;
    ops::count(n * (along.len() + 1), n * along.len());
    let mut g = z.g().clone();
    let mut r = List::filled(0.0, n);
    for i in 0..n {
        let l = lambda[i];
        let row = g.row_mut(i);
        row.iter_mut().zip(along).for_each(|(g, q)| *g -= l * q);
        let remainder = std::mem::replace(&mut row[j], sigma * l).abs();
        let carried = (0..n).fold(0.0, |s, k| {
            let identity = f64::from(u8::from(i == k));
            // |I − λ dᵀ| rounded up: a product and a difference.
            let rounding = 2.0 * U * (identity + (l * d[k]).abs()) + ETA;
            s + ((identity - l * d[k]).abs() + rounding) * z.r()[k]
        });
        let own = gamma(2) * (z.c()[i].abs() + (l * e).abs() + sums[i]);
        r[i] = up(
            carried + own + l.abs() * common + U * (l * sigma).abs() + remainder,
            n + 12,
        );
    }
    Zonotope::checked(op, c, g, r)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row that is left out, and a generator across the strip, cost nothing.
    #[test]
    fn what_is_not_done_is_not_counted() {
        let counted = |rows: [&[f64]; 2], q: &[f64]| {
            let g = Matrix::from_rows(&rows).unwrap();
            ops::tally(|| smallest(&g, q, 1.0))
                .1
                .total()
                .multiplications
        };
        let whole = counted([&[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]], &[1.0, 1.0, 1.0]);
        let across = counted([&[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]], &[1.0, 0.0, 1.0]);
        assert_eq!(whole - across, 3, "one candidate less");
        let left_out = counted([&[1.0, 2.0, 1.0], &[1.0, 2.0, 1.0]], &[1.0, 1.0, 1.0]);
        // The root, and for each of 3 generators a product, a quotient and a square.
        assert_eq!(whole - left_out, 1 + 3 * 3);
    }

    fn determinant(m: &Matrix) -> f64 {
        let mut m = m.clone();
        let n = m.rows();
        let mut det = 1.0;
        for k in 0..n {
            det *= m[(k, k)];
            for i in k + 1..n {
                let f = m[(i, k)] / m[(k, k)];
                for l in k..n {
                    let x = m[(k, l)];
                    m[(i, l)] -= f * x;
                }
            }
        }
        det
    }

    #[test]
    fn the_score_is_the_ratio_of_the_determinants() {
        let mut state = 5_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for (n, p) in [(2, 5), (3, 7), (4, 6)] {
            let g = Matrix::from_fn(n, p, |_, _| next());
            let z = Zonotope::new(vec![0.0; n], g.clone()).unwrap();
            let d: Vec<f64> = (0..n).map(|_| next()).collect();
            let (along, sigma) = (Matrix::from_rows(&[&d]).unwrap().mul(&g), 0.4);
            let squares = whitened_squares(&g);
            for (j, square) in squares.iter().enumerate() {
                let cut = by_generator("test", &z, &d, 0.0, sigma, along.row(0), j).unwrap();
                let ratio = determinant(&cut.g().gram()) / determinant(&g.gram());
                let q = along[(0, j)];
                let expected = sigma * sigma * square / (q * q);
                // Both by elimination of matrices of entries near 1.
                assert!((ratio - expected).abs() < 1e-9 * (1.0 + expected));
            }
        }
    }

    #[test]
    fn a_set_that_is_thin_in_one_direction_is_cut_and_not_blown_up() {
        // Generators of 10⁻⁵ beside 1, and what rounding leaves of others: a determinant computed outright is noise.
        let g = Matrix::from_rows(&[
            [1.0, 0.3, 0.0, 1e-17, 0.0],
            [1e-5, 0.0, 2e-5, 0.0, 1e-21],
            [0.2, 1e-6, 1e-5, 0.0, 0.0],
        ])
        .unwrap();
        let z = Zonotope::new(vec![0.0; 3], g).unwrap();
        for (i, sigma) in [(0, 0.1), (1, 1e-6), (2, 0.05)] {
            let d: Vec<f64> = (0..3).map(|k| f64::from(u8::from(i == k))).collect();
            let cut = intersect(&z, &d, 0.0, sigma).unwrap();
            let (before, after) = (z.radius(), cut.radius());
            let grown = before.iter().zip(&after).map(|(b, a)| a / b);
            assert!(grown.fold(0.0, f64::max) < 3.0, "{before:?} {after:?}");
            assert!(after[i] < before[i]);
        }
    }
}
