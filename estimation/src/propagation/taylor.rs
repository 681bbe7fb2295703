//! The first-order Taylor extension: f expanded to second order with the Hessian's enclosure.

use super::choice::{coordinates_of, has, nearest};
use super::{Choice, around, distances, product_up, sum_up};
use serde::{Deserialize, Serialize};
use zonobench_sets::interval_matrix::{hessian_over, jacobian_over};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::Function;
use zonobench_sets::ops;
use zonobench_sets::reduction::{girard, scott};
use zonobench_sets::rounding::{ETA, gamma, up};
use zonobench_sets::{
    ConstrainedZonotope, Interval, IntervalMatrix, IntervalVector, List, Matrix, SetError, Zonotope,
};

/// How the second-order term is split where h is not the center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Remainder {
    /// L_q = (c − h)ᵀ (Q_q + Q_qᵀ)/2: holds.
    #[default]
    Symmetric,
    /// L_q = (c − h)ᵀ Q_q with the upper triangular half Hessian, as printed: false unless h = c.
    Printed,
}

/// What becomes of the products of constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expansion {
    /// All products of two constraints tie the products of two coordinates, as printed.
    #[default]
    Full,
    /// They are dropped; the terms in p share ξ with the first-order part, which takes no copy of the
    /// constraints and is tighter; and the rest is reduced to 2n generators by Girard's rule at once.
    /// Not in the paper.
    Lean,
}

/// Encloses { f(x, w) : x ∈ X, w ∈ W } for f of n + n_w inputs; `hull` is the interval hull of X.
///
/// With Z = X × W = ⟨c, G, A, b, r, δ⟩, Q_q the upper triangular half Hessians over
/// the hull of Z and h, p = c − h and ζ = h + p + G ξ:
///
/// f_q = f_q(h) + ∇f_q(h)(ζ − h) + pᵀ Q_q p + 2 pᵀ Q_q^s G ξ + ξᵀ Gᵀ Q_q G ξ, Q^s = (Q + Qᵀ)/2.
///
/// * ξ_i² = ½ + ½ ξ̃_ii, ξ_iξ_j = ξ̃_ij: ξᵀ Q̃ ξ ∈ ⟨½ tr mid Q̃, [½ mid Q̃_ii | mid Q̃_ij + mid Q̃_ji | diag d]⟩ with
///   d_q = ⌈Σ rad Q̃_ij⌉ = ⌈(|G|1)ᵀ (rad Q + γ |mid Q|) |G|1⌉, the rounding of Q̃ = Gᵀ Q G included;
/// * rows r ≤ s of A give Σ_i ½ A_ri A_si ξ̃_ii + Σ_{i<j} (A_ri A_sj + A_rj A_si) ξ̃_ij = b_r b_s − ½ Σ A_ri A_si
///   within δ̃_rs = ⌈|b_r| δ_s + |b_s| δ_r + δ_r δ_s + γ_{p+3}(|A_r|1 |A_s|1 + |b_r b_s|)⌉ ([`Expansion`]);
/// * the terms in p are L (p + 2 G ξ), an interval matrix times a constrained zonotope, enclosed as in
///   [`mean_value`](super::mean_value); without p they are absent ([`Remainder`]). The lean expansion
///   leaves ξ as it is: f_q(h) − L p + (∇f_q(h) + 2 L)(ζ − h), the radii of the sum times the hull of ζ − h;
/// * a ζ that is off p + G ξ by s, |s| ≤ r, adds at most (2 |p + G ξ| + r)ᵀ |Q^s| r, which goes into r.
///
/// `C4` and `xb` rewrite X so that h is (nearly always) its center. Holds for any h with
/// [`Remainder::Symmetric`]. Fails as [`mean_value`](super::mean_value).
///
/// Source: [Rego2020, Theorem 3], corrected: its proof takes 2 pᵀ Q G ξ for pᵀ Q G ξ + (G ξ)ᵀ Q p with a
/// triangular Q, and f = z₁z₂, c = (0, 1), G = I, h = 0 gives [−1, 1] where the truth is [−2, 2].
#[allow(
    clippy::too_many_arguments,
    reason = "the set, its hull and the three readings of one theorem"
)]
pub fn first_order<F: Function>(
    f: &F,
    x: &ConstrainedZonotope,
    hull: &IntervalVector,
    w: &ConstrainedZonotope,
    choice: Choice,
    remainder: Remainder,
    expansion: Expansion,
    lp: &mut LinearProgram,
) -> Result<ConstrainedZonotope, SetError> {
    let hull_w = w.interval_hull_with(lp)?;
    let (x, h) = centered(f, x.clone(), hull, &hull_w, choice, lp)?;
    let z = x.cartesian_product(w);
    let h = List::concat(&[&h[..], w.c()]);
    let over = around(&IntervalVector::stack(&[hull, &hull_w]), &h);
    first_order_about(f, &z, &over, &h, remainder, expansion)
}

/// The first-order Taylor extension of a zonotope about its center:
/// ⟨f(c) + c̃, [∇f(c) G, G̃, diag d]⟩.
///
/// [`first_order`] without constraints and with h = c. Source: Combastel 2005; [Rego2020, Sec. 5].
pub fn zonotope_first_order<F: Function>(
    f: &F,
    x: &Zonotope,
    w: &Zonotope,
) -> Result<Zonotope, SetError> {
    let z = x.cartesian_product(w);
    let over = z.interval_hull()?;
    let h = List::from(z.c());
    let set = first_order_about(
        f,
        &z.into(),
        &over,
        &h,
        Remainder::Symmetric,
        Expansion::Full,
    )?;
    Ok(set.zonotope().clone())
}

/// X, rewritten where the choice asks for it, and h.
fn centered<F: Function>(
    f: &F,
    x: ConstrainedZonotope,
    hull: &IntervalVector,
    hull_w: &IntervalVector,
    choice: Choice,
    lp: &mut LinearProgram,
) -> Result<(ConstrainedZonotope, List<f64>), SetError> {
    let in_place = matches!(choice, Choice::C4 | Choice::C4xb) && has(&x, x.c(), lp)?;
    if in_place {
        let h = List::from(x.c());
        return Ok((x, h));
    }
    match choice {
        Choice::C4 => {
            let h = nearest(&x, &hull.mid(), lp)?;
            let m = coordinates_of(&x, &h, &scott::coordinate_bounds(&x)?, lp)?;
            let x = scott::recentred(&x, &m)?;
            let h = List::from(x.c());
            Ok((x, h))
        }
        Choice::Xb | Choice::C4xb => {
            let free = scott::eliminate_constraints(&x, 0)?;
            let h = nearest(&x, free.c(), lp)?;
            Ok((free.intersect(&x)?, h))
        }
        Choice::C1 | Choice::C2 | Choice::C3 => {
            let free = || Ok(List::from(scott::eliminate_constraints(&x, 0)?.c()));
            let weights = || {
                let (_, j) = jacobian_over(f, &IntervalVector::stack(&[hull, hull_w]))?;
                let rad = j.rad();
                Ok((0..hull.dim())
                    .map(|j| (0..rad.rows()).map(|i| 2.0 * rad[(i, j)]).sum())
                    .collect())
            };
            let h = choice.point(&x, hull, free, weights, lp)?;
            Ok((x, h))
        }
    }
}

/// Encloses { f(ζ) : ζ ∈ Z } by the expansion of [`first_order`] about `h`; `over` contains Z and h.
///
/// Fails as [`first_order`].
pub fn first_order_about<F: Function>(
    f: &F,
    z: &ConstrainedZonotope,
    over: &IntervalVector,
    h: &[f64],
    remainder: Remainder,
    expansion: Expansion,
) -> Result<ConstrainedZonotope, SetError> {
    let (value, gradient) = jacobian_over(f, &IntervalVector::point(h)?)?;
    let (_, _, hessians) = hessian_over(f, over)?;
    let halves: List<IntervalMatrix> = hessians.iter().map(half).collect();
    if expansion == Expansion::Lean {
        return lean(z, over, h, remainder, &value, &gradient, &halves);
    }
    let minus: List<f64> = h.iter().map(|x| -x).collect();
    let first = z
        .translate(&minus)?
        .affine_map(&gradient.mid(), &value.mid())?;
    let rounding = product_up(&gradient.rad(), &distances(z.zonotope(), h));
    let rounding = sum_up(&rounding, &by_rounding_box(z, &halves, h));
    let first = first.widened_by(&sum_up(&value.rad(), &rounding))?;
    if halves.iter().all(is_zero) {
        return Ok(first);
    }
    let mut sum = first.minkowski_sum(&second_order(z, &halves)?)?;
    if z.c() != h {
        sum = sum.minkowski_sum(&off_center(z, &halves, h, remainder)?)?;
    }
    Ok(sum)
}

/// [`Expansion::Lean`].
fn lean(
    z: &ConstrainedZonotope,
    over: &IntervalVector,
    h: &[f64],
    remainder: Remainder,
    value: &IntervalVector,
    gradient: &IntervalMatrix,
    halves: &[IntervalMatrix],
) -> Result<ConstrainedZonotope, SetError> {
    let p = off_by(z, h);
    let l = second_order_weights(&p, halves, remainder);
    let slope = IntervalMatrix::from_fn(l.rows(), l.cols(), |q, k| {
        gradient[(q, k)] + l[(q, k)] * 2.0
    });
    let start: IntervalVector = (0..l.rows())
        .map(|q| {
            let terms = l.row(q).iter().zip(&p);
            terms.fold(value[q], |sum, (&l, &p)| sum - l * p)
        })
        .collect();
    let minus: List<f64> = h.iter().map(|x| -x).collect();
    let first = z
        .translate(&minus)?
        .affine_map(&slope.mid(), &start.mid())?;
    let first = first.widened_by(&sum_up(&start.rad(), &by_rounding_box(z, halves, h)))?;
    let far: List<f64> = over.iter().zip(h).map(|(o, &h)| (*o - h).mag()).collect();
    let slopes = product_up(&slope.rad(), &far);
    if halves.iter().all(is_zero) {
        return first.widened_by(&slopes);
    }
    let (center, g, rest) = products(z, halves);
    let rest = sum_up(&rest, &slopes);
    let second = Zonotope::new(center, Matrix::hcat(&[&g, &Matrix::diagonal(&rest)]))?;
    first.minkowski_sum(&girard::reduce(&second, 2 * l.rows())?.into())
}

/// p = c − h, enclosed.
fn off_by(z: &ConstrainedZonotope, h: &[f64]) -> List<Interval> {
    z.c()
        .iter()
        .zip(h)
        .map(|(&c, &h)| Interval::point(c) - h)
        .collect()
}

/// L_q = pᵀ Q_q, Q_q symmetric or as printed.
fn second_order_weights(
    p: &[Interval],
    halves: &[IntervalMatrix],
    remainder: Remainder,
) -> IntervalMatrix {
    let n = p.len();
    IntervalMatrix::from_fn(halves.len(), n, |q, k| {
        let q = &halves[q];
        (0..n).fold(Interval::ZERO, |sum, i| {
            let entry = match remainder {
                Remainder::Symmetric => (q[(i, k)] + q[(k, i)]) * 0.5,
                Remainder::Printed => q[(i, k)],
            };
            sum + p[i] * entry
        })
    })
}

/// Whether every entry is exactly 0. Where all half Hessians are, f is affine over the box, and each
/// second-order term and its remainder are 0.
fn is_zero(q: &IntervalMatrix) -> bool {
    q.as_slice().iter().all(|e| *e == Interval::ZERO)
}

/// Q with Q_ii = ½ H_ii, Q_ij = H_ij above the diagonal, 0 below.
fn half(hessian: &IntervalMatrix) -> IntervalMatrix {
    IntervalMatrix::from_fn(hessian.rows(), hessian.cols(), |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => hessian[(i, j)],
        std::cmp::Ordering::Equal => hessian[(i, i)] * 0.5,
        std::cmp::Ordering::Greater => Interval::ZERO,
    })
}

/// ⌈(2 |p + G ξ| + r)ᵀ |Q_q^s| r⌉: what the rounding box adds to the second-order terms.
fn by_rounding_box(z: &ConstrainedZonotope, halves: &[IntervalMatrix], h: &[f64]) -> List<f64> {
    if z.r().iter().all(|&r| r == 0.0) {
        return List::filled(0.0, halves.len());
    }
    let n = z.dim();
    // |p + G ξ| + r is in the distances.
    let far = distances(z.zonotope(), h);
    let bound = |q: &IntervalMatrix| {
        let mag = q.mag();
        let mut sum = 0.0;
        for k in 0..n {
            for l in k..n {
                // Q_kl stands for both orders; off the diagonal ½ (kl) + ½ (lk).
                let moved = far[k] * z.r()[l] + far[l] * z.r()[k] + z.r()[k] * z.r()[l];
                sum += mag[(k, l)] * (moved + ETA) + ETA;
            }
        }
        up(sum, n * n + 6)
    };
    halves.iter().map(bound).collect()
}

/// Encloses { ξᵀ Gᵀ Q_q G ξ } over q: the columns ii, then ij for i < j in lexicographic order, then diag d.
fn second_order(
    z: &ConstrainedZonotope,
    halves: &[IntervalMatrix],
) -> Result<ConstrainedZonotope, SetError> {
    const OP: &str = "second-order term";
    let (center, g, rest) = products(z, halves);
    let (a, b, delta) = constraint_products(z, g.cols());
    let zonotope = Zonotope::new(center, g)?;
    let set = ConstrainedZonotope::with_slack(zonotope, a, b, delta)?;
    if set.dim() != rest.len() {
        return Err(SetError::Dimension {
            op: OP,
            expected: set.dim(),
            got: rest.len(),
        });
    }
    set.plus_box(&rest)
}

/// c̃, the columns of ξ̃ and d of ξᵀ Gᵀ Q_q G ξ.
fn products(z: &ConstrainedZonotope, halves: &[IntervalMatrix]) -> (List<f64>, Matrix, List<f64>) {
    let (dim, p) = (z.dim(), z.generators());
    let pairs = p + p * (p - p.min(1)) / 2;
    let mut center = List::filled(0.0, halves.len());
    let mut g = Matrix::zeros(halves.len(), pairs);
    let mut rest = List::filled(0.0, halves.len());
    let sums = z.zonotope().abs_row_sums();
    let mut along = List::filled(0.0, p);
    // Products of three factors, summed over N twice, then over the p of the trace.
    let error = gamma(2 * dim * dim + p + 8);
    for (q, half) in halves.iter().enumerate() {
        let (mid, rad) = (half.mid(), half.rad());
        let row = g.row_mut(q);
        // Σ_l Q_kl g_l first, then its products with g_k: dim products of lists and not dim².
        for k in 0..dim {
            along.fill(0.0);
            let mut any = false;
            for l in k..dim {
                let m = mid[(k, l)];
                // Both η are what underflows before the generators multiply it: γ |m|, and m g_l.
                let by_m = (rad[(k, l)] + error * m.abs() + ETA) * sums[l] + ETA;
                rest[q] += sums[k] * by_m + ETA;
                if m != 0.0 {
                    any = true;
                    ops::count(p, p);
                    for (a, g) in along.iter_mut().zip(z.g().row(l)) {
                        *a += m * g;
                    }
                }
            }
            if any {
                add_products(row, z.g().row(k), &along);
            }
        }
        for x in &mut row[..p] {
            *x *= 0.5;
        }
        center[q] = row[..p].iter().sum();
        rest[q] = up(rest[q], dim * dim + 6);
    }
    (center, g, rest)
}

/// row += (g_i h_i | g_i h_j + g_j h_i, i < j): the coefficients of (g·ξ)(h·ξ) in the products of ξ.
fn add_products(row: &mut [f64], g: &[f64], h: &[f64]) {
    let p = g.len();
    let mut at = p;
    for i in 0..p {
        let (gi, hi) = (g[i], h[i]);
        row[i] += gi * hi;
        ops::count(1, 1);
        let pairs = &mut row[at..at + p - i - 1];
        if gi != 0.0 || hi != 0.0 {
            ops::count(2 * pairs.len(), 2 * pairs.len());
            for (x, (&gj, &hj)) in pairs.iter_mut().zip(g[i + 1..].iter().zip(&h[i + 1..])) {
                *x += gi * hj + hi * gj;
            }
        }
        at += p - i - 1;
    }
}

/// The products of the constraints r ≤ s, as rows over the products of ξ.
fn constraint_products(z: &ConstrainedZonotope, pairs: usize) -> (Matrix, List<f64>, List<f64>) {
    let (p, q) = (z.generators(), z.constraints());
    let norms: List<f64> = (0..q)
        .map(|r| up(z.a().row(r).iter().fold(0.0, |s, x| s + x.abs()), p))
        .collect();
    let mut a = Matrix::zeros(q * (q + 1) / 2, pairs);
    let (mut b, mut delta) = (List::new(), List::new());
    for r in 0..q {
        for s in r..q {
            let row = a.row_mut(b.len());
            add_products(row, z.a().row(r), z.a().row(s));
            for x in &mut row[..p] {
                *x *= 0.5;
            }
            let (br, bs, dr, ds) = (z.b()[r], z.b()[s], z.delta()[r], z.delta()[s]);
            let trace: f64 = row[..p].iter().sum();
            b.push(br * bs - trace);
            let sizes = norms[r] * norms[s] + (br * bs).abs();
            delta.push(up(
                br.abs() * ds + bs.abs() * dr + dr * ds + gamma(p + 3) * sizes + ETA,
                8,
            ));
        }
    }
    (a, b, delta)
}

/// Encloses { L (p + 2 G ξ) : L ∈ \[L\], A ξ = b }, p = c − h: a copy of ξ with its own constraints.
fn off_center(
    z: &ConstrainedZonotope,
    halves: &[IntervalMatrix],
    h: &[f64],
    remainder: Remainder,
) -> Result<ConstrainedZonotope, SetError> {
    let n = z.dim();
    let l = second_order_weights(&off_by(z, h), halves, remainder);
    // p + 2 G ξ = 2 (c + G ξ) − (c + h).
    let shift: List<f64> = z.c().iter().zip(h).map(|(c, h)| -(c + h)).collect();
    let double = Matrix::identity(n).scale(2.0);
    let arm = z.affine_map(&double, &shift)?;
    let exact: List<Interval> = z
        .c()
        .iter()
        .zip(h)
        .map(|(&c, &h)| -(Interval::point(c) + h))
        .collect();
    let arm = arm.widened_by(
        &exact
            .iter()
            .zip(&shift)
            .map(|(e, &s)| (*e - s).mag())
            .collect::<List<_>>(),
    )?;
    let free = scott::eliminate_constraints(&arm, 0)?;
    let sides = product_up(&l.rad(), &distances(free.zonotope(), &List::filled(0.0, n)));
    arm.linear_map(&l.mid())?.plus_box(&sides)
}
