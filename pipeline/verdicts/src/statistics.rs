//! The few statistics that scores and verdicts need: means in a fixed order, Student's t, a bootstrap.

/// Mean and standard deviation (n − 1) of `values`, summed in order; the deviation is 0 for one value.
pub fn mean_sd(values: &[f64]) -> Option<(f64, f64)> {
    if values.is_empty() {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    if values.len() == 1 {
        return Some((mean, 0.0));
    }
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    Some((mean, (squares / (n - 1.0)).sqrt()))
}

/// Sample skewness m₃ / m₂^{3/2}; 0 where all values are equal.
pub fn skewness(values: &[f64]) -> f64 {
    let Some((mean, _)) = mean_sd(values) else {
        return 0.0;
    };
    let n = values.len() as f64;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    let cubes: f64 = values
        .iter()
        .map(|x| (x - mean) * (x - mean) * (x - mean))
        .sum();
    let m2 = squares / n;
    // A spread at rounding level has no meaningful skewness.
    if m2.sqrt() <= 1e-12 * mean.abs() {
        0.0
    } else {
        cubes / n / (m2 * m2.sqrt())
    }
}

/// The quantile of Student's t with `dof` ≥ 1 degrees of freedom at probability `p` in (1/2, 1):
/// the t with I_{dof/(dof + t²)}(dof/2, 1/2) = 2(1 − p), by bisection.
pub fn student_t(p: f64, dof: usize) -> f64 {
    let tail = 2.0 * (1.0 - p);
    let nu = dof as f64;
    let probability = |t: f64| incomplete_beta(nu / 2.0, 0.5, nu / (nu + t * t));
    let (mut lo, mut hi) = (0.0, 1.0);
    while probability(hi) > tail && hi < 1e12 {
        hi *= 2.0;
    }
    for _ in 0..200 {
        let mid = 0.5 * (lo + hi);
        if mid <= lo || mid >= hi {
            break;
        }
        if probability(mid) > tail {
            lo = mid
        } else {
            hi = mid
        }
    }
    0.5 * (lo + hi)
}

/// The regularized incomplete beta function I_x(a, b), by its continued fraction (modified Lentz).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = libm::exp(
        libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b)
            + a * libm::log(x)
            + b * libm::log1p(-x),
    ) / a;
    let keep_off_zero = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / keep_off_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut f = d;
    for m in 1..500 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for numerator in [even, odd] {
            d = 1.0 / keep_off_zero(1.0 + numerator * d);
            c = keep_off_zero(1.0 + numerator / c);
            f *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * f
}

/// Runs from which on a spread that is skewed, or that of a ratio, is resampled: of fewer the extreme quantiles are not
/// among the draws.
const MANY: usize = 30;

/// The offsets [lo, hi] such that a mean of `m` runs lies in (our mean over `n` + offsets) with probability 99 %, for a
/// Gaussian spread: ± t · √(sd²/m + sd²/n), sd that of `values` and t the two-sided 99 % quantile at their number
/// less one degrees of freedom. Of 30 values or more that are skewed, by resampling.
pub fn prediction_offsets(values: &[f64], m: usize, n: usize) -> (f64, f64) {
    if values.len() >= MANY && skewness(values).abs() > 1.0 {
        let pairs: Vec<(f64, f64)> = values.iter().map(|&x| (x, 0.0)).collect();
        return resampled_offsets(&pairs, m, n, |x, _| x);
    }
    gaussian_offsets(values, m, n)
}

fn gaussian_offsets(values: &[f64], m: usize, n: usize) -> (f64, f64) {
    let Some((_, sd)) = mean_sd(values).filter(|_| values.len() > 1) else {
        return (0.0, 0.0);
    };
    let (n, m) = (n.max(1) as f64, m.max(1) as f64);
    let half = student_t(0.995, values.len() - 1) * (sd * sd / m + sd * sd / n).sqrt();
    (-half, half)
}

/// The offsets of a statistic of two means over the same runs, such as their ratio: of 30 pairs or more by resampling, of
/// fewer those of a Gaussian spread of the jackknife's pseudo-values N θ − (N − 1) θ₋ᵢ, which are the values themselves
/// where the statistic is linear.
pub fn paired_offsets(
    pairs: &[(f64, f64)],
    m: usize,
    n: usize,
    statistic: impl Fn(f64, f64) -> f64,
) -> (f64, f64) {
    if pairs.len() >= MANY {
        return resampled_offsets(pairs, m, n, statistic);
    }
    let count = pairs.len() as f64;
    let (x, y) = (pairs.iter()).fold((0.0, 0.0), |(x, y), (a, b)| (x + a, y + b));
    let all = statistic(x / count, y / count);
    let pseudo = |&(a, b): &(f64, f64)| {
        let without = statistic((x - a) / (count - 1.0), (y - b) / (count - 1.0));
        count * all - (count - 1.0) * without
    };
    let values: Vec<f64> = match pairs {
        [] | [_] => Vec::new(),
        pairs => pairs.iter().map(pseudo).collect(),
    };
    gaussian_offsets(&values, m, n)
}

/// The 0.5 % and 99.5 % quantiles of (statistic over m runs) − (statistic over n runs), the runs drawn in pairs, 2000
/// times from a fixed seed.
fn resampled_offsets(
    pairs: &[(f64, f64)],
    m: usize,
    n: usize,
    statistic: impl Fn(f64, f64) -> f64,
) -> (f64, f64) {
    const RESAMPLES: usize = 2000;
    let mut state = 0x7a6f_6e6f_6265_6e63_u64;
    let mut resample = |count: usize| {
        let (mut x, mut y) = (0.0, 0.0);
        for _ in 0..count {
            let (a, b) = pairs[index(&mut state, pairs.len())];
            x += a;
            y += b;
        }
        statistic(x / count as f64, y / count as f64)
    };
    let mut differences: Vec<f64> = (0..RESAMPLES)
        .map(|_| resample(m.max(1)) - resample(n.max(1)))
        .collect();
    differences.sort_by(f64::total_cmp);
    (
        differences[RESAMPLES / 200 - 1],
        differences[RESAMPLES - RESAMPLES / 200],
    )
}

/// A number below `n` from SplitMix64; the bias of the multiplication is below 2⁻⁴⁰ here.
fn index(state: &mut u64, n: usize) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    ((u128::from(z) * n as u128) >> 64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_t_quantile_agrees_with_printed_tables() {
        for (p, dof, t) in [
            (0.975, 1, 12.706_204_736),
            (0.995, 1, 63.656_741_162),
            (0.975, 10, 2.228_138_852),
            (0.995, 29, 2.756_385_904),
            (0.995, 199, 2.600_760_216),
            (0.99, 5, 3.364_929_999),
        ] {
            assert!(
                (student_t(p, dof) - t).abs() < 1e-8 * t,
                "{p} {dof}: {}",
                student_t(p, dof)
            );
        }
    }

    #[test]
    fn mean_and_deviation_of_three_numbers() {
        assert_eq!(mean_sd(&[1.0, 2.0, 3.0]), Some((2.0, 1.0)));
        assert_eq!(mean_sd(&[4.0]), Some((4.0, 0.0)));
        assert_eq!(mean_sd(&[]), None);
    }

    #[test]
    fn the_bootstrap_is_near_the_formula_for_a_symmetric_spread() {
        let values: Vec<f64> = (0..400).map(|i| f64::from(i) / 399.0 - 0.5).collect();
        let pairs: Vec<(f64, f64)> = values.iter().map(|&x| (x, 1.0)).collect();
        let (lo, hi) = paired_offsets(&pairs, 50, 400, |x, y| x / y);
        let (a, b) = prediction_offsets(&values, 50, 400);
        assert!(
            (lo / a - 1.0).abs() < 0.15 && (hi / b - 1.0).abs() < 0.15,
            "{lo} {hi} {a} {b}"
        );
    }

    #[test]
    fn one_skewed_sample_uses_the_bootstrap() {
        let mut values = vec![0.0; 99];
        values.push(100.0);
        let (lo, hi) = prediction_offsets(&values, 10, 100);
        assert!(lo > -5.0 && hi > 5.0, "{lo} {hi}");
    }

    #[test]
    fn a_spread_lent_to_one_run_is_that_of_a_single_draw() {
        let values = [1.0, 2.0, 3.0];
        // t at 2 degrees of freedom is 9.925, sd 1: both means over one run.
        let (lo, hi) = prediction_offsets(&values, 1, 1);
        assert!((hi - 9.925 * 2f64.sqrt()).abs() < 1e-3 && lo == -hi, "{hi}");
        assert_eq!(
            paired_offsets(&[(1.0, 2.0)], 1, 1, |x, y| x / y),
            (0.0, 0.0)
        );
        assert_eq!(prediction_offsets(&[1.0], 1, 1), (0.0, 0.0));
    }

    /// Two means of a number that is the same in the mean: 99 in 100 differences must lie in the interval.
    #[test]
    fn intervals_of_few_runs_hold_as_often_as_they_say() {
        let mut state = 5_u64;
        let mut normal = || {
            (0..12)
                .map(|_| index(&mut state, 1 << 20) as f64)
                .sum::<f64>()
        };
        let unit = 12.0 * f64::from(1_u32 << 19);
        for (runs, m, n) in [(5, 1, 1), (5, 1, 5), (3, 1, 3), (10, 20, 10)] {
            let mut held = 0;
            for _ in 0..2000 {
                // Numbers around 1 beside numbers around 2, whose ratio is compared.
                let mut draw = |count: usize| -> Vec<(f64, f64)> {
                    let mut pair = || {
                        let (x, y) = (normal() / unit, 1.0 + normal() / unit);
                        (1.0 + 0.1 * (x - 1.0), 2.0 + 0.1 * (y - 2.0))
                    };
                    (0..count).map(|_| pair()).collect()
                };
                let ratio = |x: f64, y: f64| x / y;
                let mean = |pairs: &[(f64, f64)]| {
                    let sum = pairs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
                    sum.0 / sum.1
                };
                let (lo, hi) = paired_offsets(&draw(runs), m, n, ratio);
                let difference = mean(&draw(m)) - mean(&draw(n));
                held += usize::from(lo <= difference && difference <= hi);
            }
            assert!(
                (1965..=1998).contains(&held),
                "{runs} {m} {n}: {held} of 2000"
            );
        }
    }
}
