//! Bounds on a rate that was counted.

/// The upper Clopper-Pearson bound on a rate of which `lost` of `trials` were seen, at `confidence`.
///
/// The p with P(X ≤ lost) = 1 − confidence for X ~ Bin(trials, p); with none lost it is
/// 1 − (1 − confidence)^(1/trials). 1 without trials and where all are lost. The trials must be independent for it to be a
/// bound: runs are, the sets of one run are not.
///
/// Source: \[ClopperPearson1934\].
pub fn clopper_pearson_upper(lost: u64, trials: u64, confidence: f64) -> f64 {
    if lost >= trials {
        return 1.0;
    }
    let (mut lo, mut hi) = (lost as f64 / trials as f64, 1.0);
    // The bisection stops where no number lies between its ends.
    loop {
        let p = 0.5 * (lo + hi);
        if p <= lo || p >= hi {
            return hi;
        }
        if at_most(lost, trials, p) > 1.0 - confidence {
            lo = p;
        } else {
            hi = p;
        }
    }
}

/// P(X ≤ k) for X ~ Bin(n, p) with 0 < p < 1: a sum of k + 1 terms, each from its logarithm.
fn at_most(k: u64, n: u64, p: f64) -> f64 {
    let (n, log_p, log_q) = (n as f64, libm::log(p), libm::log1p(-p));
    let choose = |i: f64| libm::lgamma(n + 1.0) - libm::lgamma(i + 1.0) - libm::lgamma(n - i + 1.0);
    (0..=k)
        .map(|i| i as f64)
        .map(|i| libm::exp(choose(i) + i * log_p + (n - i) * log_q))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a loss the bound is 1 − α^(1/n); the other values are those of R's `binom.test`
    /// (one-sided): 1 of 10 and 3 of 50 at 95 %.
    #[test]
    fn known_bounds() {
        for n in [1u64, 10, 1_000_000] {
            let exact = -libm::expm1(libm::log(0.05) / n as f64);
            let bound = clopper_pearson_upper(0, n, 0.95);
            assert!(
                (bound - exact).abs() <= 1e-9 * exact,
                "{n}: {bound} {exact}"
            );
        }
        assert!((clopper_pearson_upper(1, 10, 0.95) - 0.394_163).abs() < 1e-6);
        assert!((clopper_pearson_upper(3, 50, 0.95) - 0.147_841).abs() < 1e-5);
        assert_eq!(clopper_pearson_upper(7, 7, 0.95), 1.0);
        assert_eq!(clopper_pearson_upper(0, 0, 0.95), 1.0);
    }
}
