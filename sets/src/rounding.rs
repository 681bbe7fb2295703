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
/// operations in a row, fewer than 2⁵² of them products that may have underflowed. NaN becomes +∞.
///
/// Such products lose less than η/2 = 2⁻¹⁰²³ together. Below 2⁻⁹⁶⁹ the η that is added arrives, since the
/// result is a multiple of it or finer; above, it may be rounded away, and there `next_up`, of which the rounding of the
/// product takes half a unit, leaves half a unit of at least 2⁻¹⁰²³.
#[inline]
pub fn up(s: f64, k: usize) -> f64 {
    let bound = (s * (1.0 + 2.0 * gamma(k))).next_up() + ETA;
    if bound.is_nan() { f64::INFINITY } else { bound }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_pays_for_what_products_lost_in_every_binade_about_the_underflow() {
        // s may stand for s (1 + γ_k) + η/2 at most. η/2 is subnormal: everything is taken times 2⁶⁰, exactly.
        let scaled = |x: f64| x * (1u64 << 60) as f64;
        for exponent in 1..150_u64 {
            for mantissa in [0, 1, 2, 1 << 51, (1 << 52) - 2, (1 << 52) - 1] {
                let s = f64::from_bits(exponent << 52 | mantissa);
                for k in [1, 2, 7] {
                    let added = scaled(up(s, k)) - scaled(s);
                    let owed = scaled(s) * gamma(k) + 0.5 * scaled(ETA);
                    assert!(added >= owed, "{s:e} {k}: {added:e} {owed:e}");
                }
            }
        }
    }
}
