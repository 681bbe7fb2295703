//! How a count grows with a size: the degree of a polynomial that it is, or the slope in a log-log plot.

/// A degree of growth with the interval that it lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degree {
    /// The degree.
    pub value: f64,
    /// Lower end; equal to `value` where the degree is exact.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

impl Degree {
    /// A degree known exactly.
    pub fn exact(degree: usize) -> Self {
        let value = degree as f64;
        Self {
            value,
            lo: value,
            hi: value,
        }
    }

    /// True if the degree is exact.
    pub fn is_exact(&self) -> bool {
        self.lo == self.hi
    }
}

/// The degree of the polynomial that takes these values at consecutive integers, if its differences vanish
/// with at least `spare` of them left over: those are predictions that came true.
///
/// Newton: the d-th differences of a polynomial of degree d are constant and those after are 0. A sequence
/// of zeros has no degree.
pub fn polynomial_degree(values: &[i128], spare: usize) -> Option<usize> {
    let mut row = values.to_vec();
    let mut order = 0;
    while row.len() > spare.max(1) {
        if row.iter().all(|x| *x == row[0]) {
            return (row[0] != 0).then_some(order);
        }
        row = row.windows(2).map(|w| w[1] - w[0]).collect();
        order += 1;
    }
    None
}

/// The slope of log y over log x by least squares, with a 95 % interval from the residuals.
///
/// Points with y ≤ 0 are left out; without three points the interval is the whole line.
pub fn slope(points: &[(f64, f64)]) -> Degree {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0)
        .map(|(x, y)| (libm::log(*x), libm::log(*y)))
        .collect();
    let n = logs.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x0, y0) = (mean(&|p| p.0), mean(&|p| p.1));
    let sxx: f64 = logs.iter().map(|(x, _)| (x - x0) * (x - x0)).sum();
    let sxy: f64 = logs.iter().map(|(x, y)| (x - x0) * (y - y0)).sum();
    let value = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    if logs.len() < 3 {
        return Degree {
            value,
            lo: f64::NEG_INFINITY,
            hi: f64::INFINITY,
        };
    }
    let residual: f64 = logs
        .iter()
        .map(|(x, y)| {
            let r = y - y0 - value * (x - x0);
            r * r
        })
        .sum();
    let half = student(logs.len() - 2) * (residual / (n - 2.0) / sxx).sqrt();
    Degree {
        value,
        lo: value - half,
        hi: value + half,
    }
}

/// The 97.5 % quantile of Student's t with `dof` degrees of freedom.
fn student(dof: usize) -> f64 {
    const SMALL: [f64; 10] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
    ];
    SMALL
        .get(dof.saturating_sub(1))
        .copied()
        // Cornish and Fisher's first term about the normal quantile.
        .unwrap_or(1.96 + (1.96 * 1.96 * 1.96 + 1.96) / (4.0 * dof as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_known_by_its_differences() {
        let cube = |x: i128| 5 * x * x * x - 2 * x + 7;
        let values: Vec<i128> = (1..8).map(cube).collect();
        assert_eq!(polynomial_degree(&values, 2), Some(3));
        let mut spoilt = values.clone();
        spoilt[4] += 1;
        assert_eq!(polynomial_degree(&spoilt, 2), None);
        assert_eq!(
            polynomial_degree(&values[..4], 2),
            None,
            "nothing is left to check"
        );
        assert_eq!(polynomial_degree(&[4; 5], 2), Some(0));
        assert_eq!(polynomial_degree(&[0; 5], 2), None);
    }

    #[test]
    fn a_power_has_its_exponent_and_noise_an_interval() {
        let points: Vec<(f64, f64)> = (1..9)
            .map(|x| (f64::from(x), 3.0 * f64::from(x * x)))
            .collect();
        let degree = slope(&points);
        assert!((degree.value - 2.0).abs() < 1e-12 && degree.hi - degree.lo < 1e-6);
        let noisy: Vec<(f64, f64)> = points
            .iter()
            .enumerate()
            .map(|(i, &(x, y))| (x, y * if i % 2 == 0 { 1.1 } else { 0.9 }))
            .collect();
        let degree = slope(&noisy);
        assert!(degree.lo < 2.0 && 2.0 < degree.hi && degree.hi - degree.lo > 0.05);
    }
}
