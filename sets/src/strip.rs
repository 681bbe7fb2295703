//! The intersection of a zonotope with a strip, as a zonotope: Bravo's choice of the smallest.
//!
//! Every x in the strip |dᵀx − y| ≤ σ equals (I − λ dᵀ) x + λ (y + σ ζ), |ζ| ≤ 1, for any vector λ. With
//! λ = g_j/(dᵀg_j) generator j drops out and σ λ takes its place, so the number of generators stays. Each j
//! gives one enclosure, the zonotope itself is another; the one with the least det(T Tᵀ) is taken.
//!
//! Source: J. M. Bravo, T. Alamo, E. F. Camacho, "Bounded error identification of systems with time-varying
//! parameters", IEEE TAC 2006; used in [Rego2020, Sec. 6] for ZMV and ZFO.

use crate::matrix::dot;
use crate::rounding::{ETA, U, gamma, up};
use crate::{Interval, Matrix, SetError, Zonotope, ops};

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
    let minus: Vec<f64> = d.iter().map(|x| -x).collect();
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
    match smallest(z.g(), d, along, sigma) {
        None => Ok(z.clone()),
        Some(j) => by_generator(OP, z, d, y, sigma, along, j),
    }
}

/// The generator whose enclosure has the least det(T Tᵀ), or `None` for the zonotope itself.
///
/// T_j T_jᵀ = S − (S d g_jᵀ + g_j (S d)ᵀ)/q_j + g_j g_jᵀ (qᵀq + σ²)/q_j² with S = G Gᵀ and q = Gᵀd: n² a
/// candidate.
fn smallest(g: &Matrix, d: &[f64], q: &[f64], sigma: f64) -> Option<usize> {
    let n = g.rows();
    // Columns this much along the strip would be divided by rounding.
    let cut = 1e-12 * q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let s = g.gram();
    let sd = s.mul_vec(d);
    let size = dot(q, q) + sigma * sigma;
    let mut best = (determinant(&mut s.clone()), None);
    let mut t = Matrix::zeros(n, n);
    for (j, &q) in q.iter().enumerate() {
        if q.abs() <= cut {
            continue;
        }
        ops::count(n + 5 * n * (n + 1) / 2, 3 * n * (n + 1) / 2);
        for i in 0..n {
            let (a, b) = (g[(i, j)] / q, sd[i]);
            for k in 0..=i {
                let (c, e) = (g[(k, j)] / q, sd[k]);
                let value = s[(i, k)] - (b * c + a * e) + a * c * size;
                t[(i, k)] = value;
                t[(k, i)] = value;
            }
        }
        let candidate = determinant(&mut t);
        if candidate < best.0 {
            best = (candidate, Some(j));
        }
    }
    best.1
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
    let lambda: Vec<f64> = (0..n).map(|i| z.g()[(i, j)] / along[j]).collect();
    let dc = d.iter().zip(z.c()).fold(0.0, |s, (d, c)| s + d * c);
    let e = y - dc;
    let c: Vec<f64> = z.c().iter().zip(&lambda).map(|(c, l)| c + l * e).collect();
    let sums = z.abs_row_sums();
    let abs_dc = d
        .iter()
        .zip(z.c())
        .fold(0.0, |s, (d, c)| s + d.abs() * c.abs());
    let abs_dg = d.iter().zip(&sums).fold(0.0, |s, (d, g)| s + d.abs() * g);
    let common = gamma(n + 1) * (y.abs() + abs_dc) + gamma(n + 2) * abs_dg + 2.0 * ETA;
    ops::count(n * (along.len() + 1), n * along.len());
    let mut g = z.g().clone();
    let mut r = vec![0.0; n];
    for i in 0..n {
        let l = lambda[i];
        let row = g.row_mut(i);
        row.iter_mut().zip(along).for_each(|(g, q)| *g -= l * q);
        let remainder = std::mem::replace(&mut row[j], sigma * l).abs();
        let carried = (0..n).fold(0.0, |s, k| {
            let identity = f64::from(u8::from(i == k));
            // |I − λ dᵀ| rounded up: a product and a difference.
            s + ((identity - l * d[k]).abs() + 2.0 * U * (identity + (l * d[k]).abs())) * z.r()[k]
        });
        let own = gamma(2) * (z.c()[i].abs() + (l * e).abs() + sums[i]);
        r[i] = up(
            carried + own + l.abs() * common + U * (l * sigma).abs() + remainder,
            n + 12,
        );
    }
    Zonotope::checked(op, c, g, r)
}

/// det M of a symmetric positive semidefinite M by elimination with diagonal pivots; M is overwritten.
fn determinant(m: &mut Matrix) -> f64 {
    let n = m.rows();
    let mut det = 1.0;
    let mut left: Vec<usize> = (0..n).collect();
    while let Some((at, &k)) = left
        .iter()
        .enumerate()
        .max_by(|a, b| m[(*a.1, *a.1)].total_cmp(&m[(*b.1, *b.1)]))
    {
        let pivot = m[(k, k)];
        if pivot <= 0.0 {
            return 0.0;
        }
        det *= pivot;
        left.swap_remove(at);
        ops::count(1 + left.len() * (1 + left.len()), left.len() * left.len());
        for &i in &left {
            let f = m[(i, k)] / pivot;
            for &l in &left {
                let x = m[(k, l)];
                m[(i, l)] -= f * x;
            }
        }
    }
    det
}
