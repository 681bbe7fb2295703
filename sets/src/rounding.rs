//! Upper bounds on rounded sums: the constants and the one function that every rounding rule uses.
//!
//! u = 2⁻⁵³, γ_k = k·u / (1 − k·u), η = 2⁻¹⁰²². A nonnegative sum s computed with at most k
//! operations in a row lies within a factor 1 ± γ_k of the exact one, so
//! ⌈s⌉_k = next_up(s · (1 + 2γ_k)) + η is never below it. `next_up` alone is not enough for two roundings.

/// Unit roundoff u = 2⁻⁵³.
pub const U: f64 = f64::EPSILON / 2.0;

/// The smallest normal number η = 2⁻¹⁰²², added wherever a product may have underflowed.
pub const ETA: f64 = f64::MIN_POSITIVE;

/// An upper bound on γ_k = k·u / (1 − k·u), for k < 2⁴⁰.
#[inline]
pub fn gamma(k: usize) -> f64 {
    // k·u·(1 + 2⁻¹⁰) ≥ k·u/(1 − k·u) needs k·u ≤ 2⁻¹¹; k < 2⁴⁰ has k·u < 2⁻¹³, and the rest pays for
    // the one rounding here (k·u is exact).
    let k = k as f64;
    k * U * (1.0 + 1.0 / 1024.0)
}

/// ⌈s⌉: an upper bound on a nonnegative sum of which `s` is the value computed with at most `k`
/// operations in a row. NaN becomes +∞.
#[inline]
pub fn up(s: f64, k: usize) -> f64 {
    let bound = (s * (1.0 + 2.0 * gamma(k))).next_up() + ETA;
    if bound.is_nan() { f64::INFINITY } else { bound }
}
