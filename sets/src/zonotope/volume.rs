//! The volume of a zonotope: a sum over all parallelepipeds that n of its generators span.

use super::Zonotope;
use crate::{Matrix, units};

/// The most determinants that [`Zonotope::volume`] evaluates.
pub const MOST_DETERMINANTS: u64 = 1_000_000;

impl Zonotope {
    /// The volume of ⟨c, G⟩, 2ⁿ Σ |det G_S| over all sets S of n generators, rounded to nearest.
    ///
    /// `None` if there are more than `MOST_DETERMINANTS` such sets and n > 2; n = 1 and n = 2 take
    /// O(p) and O(p log p). 0 if p < n. The rounding box r does not enter: fold first where it
    /// should. Not a bound.
    ///
    /// Source: P. McMullen, "Volumes of projections of unit cubes", Bull. London Math. Soc. 1984.
    pub fn volume(&self) -> Option<f64> {
        let (n, p) = (self.dim(), self.generators());
        match n {
            1 => Some(2.0 * self.g.abs_row_sums()[0]),
            2 => Some(self.area()),
            _ if p < n => Some(0.0),
            _ if binomial(p, n)? > MOST_DETERMINANTS => None,
            _ => {
                // Pivots compare rows: in units of their own.
                let units = units::of_rows(&self.g);
                let minors = sum_of_minors(&units::divided_rows(&self.g, &units));
                let volume = (0..n).fold(minors, |volume, _| 2.0 * volume);
                Some(units::times(volume, &units))
            }
        }
    }
}

/// The binomial coefficient, if it and the products on the way fit.
fn binomial(p: usize, n: usize) -> Option<u64> {
    let n = n.min(p - n);
    (0..n).try_fold(1u64, |b, i| {
        Some(b.checked_mul((p - i) as u64)? / (i as u64 + 1))
    })
}

/// Σ |det G_S| over all sets S of as many columns as there are rows, in lexicographic order.
fn sum_of_minors(g: &Matrix) -> f64 {
    let (n, p) = (g.rows(), g.cols());
    let mut chosen: Vec<usize> = (0..n).collect();
    let mut sum = 0.0;
    loop {
        sum += determinant(g.select_columns(&chosen)).abs();
        // The last index that can still move, then all after it follow closely.
        let Some(i) = (0..n).rev().find(|&i| chosen[i] < p - n + i) else {
            return sum;
        };
        chosen[i] += 1;
        for k in i + 1..n {
            chosen[k] = chosen[k - 1] + 1;
        }
    }
}

/// det M by elimination with partial pivoting.
fn determinant(mut m: Matrix) -> f64 {
    let n = m.rows();
    let mut det = 1.0;
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|&a, &b| m[(a, k)].abs().total_cmp(&m[(b, k)].abs()))
            .expect("k < n, so there is a row left");
        if m[(pivot, k)] == 0.0 {
            return 0.0;
        }
        if pivot != k {
            det = -det;
            for j in k..n {
                (m[(k, j)], m[(pivot, j)]) = (m[(pivot, j)], m[(k, j)]);
            }
        }
        det *= m[(k, k)];
        for i in k + 1..n {
            let factor = m[(i, k)] / m[(k, k)];
            for j in k + 1..n {
                let x = m[(k, j)];
                m[(i, j)] -= factor * x;
            }
        }
    }
    det
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn determinants_of_small_matrices() {
        let m = Matrix::from_rows(&[[0.0, 2.0, 1.0], [1.0, 0.0, 3.0], [0.0, 0.0, 5.0]]).unwrap();
        assert_eq!(determinant(m), -10.0);
        assert_eq!(determinant(Matrix::zeros(3, 3)), 0.0);
    }

    #[test]
    fn a_cube_with_a_diagonal_has_four_parallelepipeds() {
        let g = Matrix::hcat(&[&Matrix::identity(3), &Matrix::column(&[1.0, 1.0, 1.0])]);
        let z = Zonotope::new(vec![0.0; 3], g).unwrap();
        assert_eq!(z.volume(), Some(8.0 * 4.0));
    }

    #[test]
    fn the_volume_does_not_vanish_on_the_way() {
        let s = [1e-170, 1e-170, 1e300, 1e50];
        let g = Matrix::from_fn(4, 5, |i, j| s[i] * f64::from(u8::from(i == j || j == 4)));
        let z = Zonotope::new(vec![0.0; 4], g).unwrap();
        assert!((z.volume().unwrap() / (16.0 * 5.0 * 1e10) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn too_few_generators_give_zero_and_too_many_sets_none() {
        let flat = Zonotope::new(vec![0.0; 3], Matrix::zeros(3, 2)).unwrap();
        assert_eq!(flat.volume(), Some(0.0));
        let large = Zonotope::new(vec![0.0; 12], Matrix::zeros(12, 100)).unwrap();
        assert_eq!(large.volume(), None);
        assert_eq!(binomial(5, 2), Some(10));
        assert_eq!(binomial(100_000, 50_000), None);
    }

    #[test]
    fn the_area_agrees_with_the_sum_of_minors() {
        let g = Matrix::from_fn(2, 9, |i, j| ((7 * i + 5 * j) % 11) as f64 - 4.5);
        let z = Zonotope::new(vec![0.0; 2], g.clone()).unwrap();
        let area = z.volume().unwrap();
        assert!((area - 4.0 * sum_of_minors(&g)).abs() < 1e-12 * area);
        let line = Zonotope::new(vec![0.0], Matrix::from_rows(&[[1.0, -2.0]]).unwrap()).unwrap();
        assert_eq!(line.volume(), Some(6.0));
    }
}
