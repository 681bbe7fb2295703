//! The mean value extension: f linearised with the Jacobian's enclosure.

use super::{Choice, around, distances, product_up, sum_up};
use zonobench_sets::interval_matrix::partial_jacobian_over;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::Function;
use zonobench_sets::reduction::scott;
use zonobench_sets::{
    ConstrainedZonotope, IntervalMatrix, IntervalVector, List, SetError, Zonotope,
};

/// A Jacobian whose radii are this small beside its entries is constant but for rounding.
const CONSTANT: f64 = 1e-12;

/// Encloses { f(x, w) : x ∈ X, w ∈ W } for f of n + n_w inputs; `hull` is the interval hull of X.
///
/// f(h, W) ⊕ mid J (X − h) ⊕ diag(P) Bⁿ, where J contains the Jacobian in x over B × hull W, B the hull of X
/// and h, and P_i = ⌈Σ_k rad J_ik (|c̄_k − h_k| + |Ḡ_k| 1 + r̄_k)⌉ with X̄ = ⟨c̄, Ḡ, r̄⟩ ⊇ X, its constraints
/// eliminated. f(h, W) is enclosed in the same way about the center of W: where w enters affinely the
/// Jacobian is constant, and what its rounding costs goes into r; else n more generators hold it.
///
/// The generators are those of W, of X, and n; the constraints those of both: n_g + n_gw + n and n_c + n_cw
/// in the affine case. Holds for any h.
///
/// Fails with `Empty` if X is proved empty, `Domain` where f or a derivative may be undefined.
///
/// Source: [Rego2020, Theorems 1 and 2].
pub fn mean_value<F: Function>(
    f: &F,
    x: &ConstrainedZonotope,
    hull: &IntervalVector,
    w: &ConstrainedZonotope,
    choice: Choice,
    lp: &mut LinearProgram,
) -> Result<ConstrainedZonotope, SetError> {
    let hull_w = w.interval_hull_with(lp)?;
    let free = scott::eliminate_constraints(x, 0)?;
    let jacobian = |over: &IntervalVector| state_jacobian(f, over, &hull_w);
    let over = jacobian(hull)?;
    let weights = || {
        let rad = over.rad();
        Ok((0..rad.cols())
            .map(|j| (0..rad.rows()).map(|i| 2.0 * rad[(i, j)]).sum())
            .collect())
    };
    let h = choice.point(x, hull, || Ok(List::from(free.c())), weights, lp)?;
    let wide = around(hull, &h);
    let j = if wide == *hull {
        over
    } else {
        jacobian(&wide)?
    };
    let (start, by_noise, boxed, rounding) = at_point(f, &h, w, &hull_w)?;
    let middle = start.mid();
    let minus: List<f64> = h.iter().map(|x| -x).collect();
    let image = x.translate(&minus)?.affine_map(&j.mid(), &middle)?;
    let sides = product_up(&j.rad(), &distances(free.zonotope(), &h));
    let set = by_noise.minkowski_sum(&image)?.plus_box(&sides)?;
    let set = if boxed.iter().any(|&b| b > 0.0) {
        set.plus_box(&boxed)?
    } else {
        set
    };
    set.widened_by(&sum_up(&start.rad(), &rounding))
}

/// The mean value extension of a zonotope about its center: ⟨f(c, c_w), [mid J G, diag P, mid J_w G_w]⟩.
///
/// [`mean_value`] without constraints and with h = c. Source: Alamo, Bravo, Camacho 2005; [Rego2020, Sec. 5].
pub fn zonotope_mean_value<F: Function>(
    f: &F,
    x: &Zonotope,
    w: &Zonotope,
) -> Result<Zonotope, SetError> {
    let hull_w = w.interval_hull()?;
    let h = x.c();
    let j = state_jacobian(f, &x.interval_hull()?, &hull_w)?;
    let noise = w.clone().into();
    let (start, by_noise, boxed, rounding) = at_point(f, h, &noise, &hull_w)?;
    let minus: List<f64> = h.iter().map(|x| -x).collect();
    let image = ConstrainedZonotope::from(x.translate(&minus)?.affine_map(&j.mid(), &start.mid())?);
    let sides = product_up(&j.rad(), &distances(x, h));
    let set = image.plus_box(&sides)?.minkowski_sum(&by_noise)?;
    let set = if boxed.iter().any(|&b| b > 0.0) {
        set.plus_box(&boxed)?
    } else {
        set
    };
    Ok(set
        .widened_by(&sum_up(&start.rad(), &rounding))?
        .zonotope()
        .clone())
}

/// The Jacobian in x over a box of states and the box of noises.
fn state_jacobian<F: Function>(
    f: &F,
    over: &IntervalVector,
    hull_w: &IntervalVector,
) -> Result<IntervalMatrix, SetError> {
    let all = IntervalVector::stack(&[over, hull_w]);
    let (_, j) = partial_jacobian_over(f, &all, 0..over.dim())?;
    Ok(j)
}

/// f(h, c_w), the set mid J_w (W − c_w), the box of what J_w varies, and what is mere rounding of it.
type AtPoint = (IntervalVector, ConstrainedZonotope, List<f64>, List<f64>);

/// The parts of f(h, W).
fn at_point<F: Function>(
    f: &F,
    h: &[f64],
    w: &ConstrainedZonotope,
    hull_w: &IntervalVector,
) -> Result<AtPoint, SetError> {
    let n = h.len();
    let (h, c_w) = (IntervalVector::point(h)?, w.c());
    let at = IntervalVector::stack(&[&h, &IntervalVector::point(c_w)?]);
    let (value, _) = partial_jacobian_over(f, &at, 0..0)?;
    let over = IntervalVector::stack(&[&h, &around(hull_w, c_w)]);
    let (_, j) = partial_jacobian_over(f, &over, n..n + c_w.len())?;
    let minus: List<f64> = c_w.iter().map(|x| -x).collect();
    let image = w.translate(&minus)?.linear_map(&j.mid())?;
    let varies = product_up(&j.rad(), &distances(w.zonotope(), c_w));
    let affine = j.as_slice().iter().all(|e| e.rad() <= CONSTANT * e.mag());
    let none = List::filled(0.0, n);
    Ok(if affine {
        (value, image, none, varies)
    } else {
        (value, image, varies, none)
    })
}
