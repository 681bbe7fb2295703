//! How wide the boxes of Box-State-Est can become: Proposition 1, corrected and as printed.

use crate::EstimationError;
use zonobench_sets::Matrix;

/// A bound on the width of the boxes: b_v W(\[v\]) + b_d W(\[d\]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WidthBound {
    /// b_v.
    pub of_v: f64,
    /// b_d.
    pub of_d: f64,
}

impl WidthBound {
    /// b_v W(\[v\]) + b_d W(\[d\]), where `v` and `d` are the largest widths of the two boxes.
    pub fn width(&self, v: f64, d: f64) -> f64 {
        self.of_v * v + self.of_d * d
    }
}

/// The bound on max_i W(\[x_k\]_i) that holds for every observable pair (A, C) and every k ≥ n − 1:
///
/// b_v = ‖ |M₁| |O*| H ‖∞ and b_d = ‖ |M₂| 1 + |M₁| |O*| |O_d| 1 ‖∞,
///
/// where H stacks n copies of I and the 1 behind M₂ and O_d stacks n − 1 copies. `a` n × n, `c` n_y × n.
/// Rounded to nearest. Attained in the paper's example.
///
/// Source: [MeslemRamdani, Proposition 1], corrected: an interval product widens by |M|, so the absolute
/// values must be taken before the products and not after, as in [`printed_width_bound`].
///
/// Fails where the pair is not observable.
pub fn width_bound(a: &Matrix, c: &Matrix) -> Result<WidthBound, EstimationError> {
    let Powers {
        m1,
        powers,
        outputs,
        o_star,
    } = Powers::new(a, c)?;
    let n = a.rows();
    let back = m1.abs().mul(&o_star.abs());
    let of_v = norm_inf(&back.mul(&copies(n, c.rows())));
    let magnitudes: Vec<Matrix> = outputs.iter().map(Matrix::abs).collect();
    let of_d = sum(&powers.iter().map(Matrix::abs).collect::<Vec<_>>(), n, n)
        .add(&back.mul(&lower_block_sums(&magnitudes, c.rows(), n)));
    Ok(WidthBound {
        of_v,
        of_d: norm_inf(&of_d),
    })
}

/// The bound as printed, for comparison only: b_v = ‖M₁‖ ‖O* H‖, b_d = ‖M₂ 1‖ + ‖M₁‖ ‖O* O_d 1‖ (all ‖·‖∞).
///
/// Opposite signs cancel inside its products, so boxes can be wider: for A = [0.9, −0.9; 0, 0.6],
/// C = [−1, 2] by an order of magnitude.
///
/// Source: [MeslemRamdani, Proposition 1, Eq. (17)].
///
/// Fails where the pair is not observable.
pub fn printed_width_bound(a: &Matrix, c: &Matrix) -> Result<WidthBound, EstimationError> {
    let Powers {
        m1,
        powers,
        outputs,
        o_star,
    } = Powers::new(a, c)?;
    let n = a.rows();
    let m1 = norm_inf(&m1);
    Ok(WidthBound {
        of_v: m1 * norm_inf(&o_star.mul(&copies(n, c.rows()))),
        of_d: norm_inf(&sum(&powers, n, n))
            + m1 * norm_inf(&o_star.mul(&lower_block_sums(&outputs, c.rows(), n))),
    })
}

/// The matrices of Proposition 1, rounded to nearest.
struct Powers {
    /// Aⁿ⁻¹.
    m1: Matrix,
    /// I, A, …, Aⁿ⁻².
    powers: Vec<Matrix>,
    /// C, C A, …, C Aⁿ⁻².
    outputs: Vec<Matrix>,
    /// O*.
    o_star: Matrix,
}

impl Powers {
    fn new(a: &Matrix, c: &Matrix) -> Result<Self, EstimationError> {
        let n = a.rows();
        let mut powers = vec![Matrix::identity(n)];
        for i in 1..n {
            powers.push(a.mul(&powers[i - 1]));
        }
        let mut outputs: Vec<Matrix> = powers.iter().map(|p| c.mul(p)).collect();
        let o = Matrix::vcat(&outputs.iter().collect::<Vec<_>>());
        let rank = o
            .rank()
            .map_err(EstimationError::at(0, "observability matrix"))?;
        if rank < n {
            return Err(EstimationError::Unobservable {
                kind: "box-state-est",
                rank,
                n,
            });
        }
        let o_star = o.pseudo_inverse().map_err(EstimationError::at(
            0,
            "left inverse of the observability matrix",
        ))?;
        outputs.pop();
        let m1 = powers.pop().expect("n is at least 1");
        Ok(Self {
            m1,
            powers,
            outputs,
            o_star,
        })
    }
}

/// [I; …; I], n copies of the identity of size m.
fn copies(n: usize, m: usize) -> Matrix {
    Matrix::from_fn(n * m, m, |i, j| f64::from(u8::from(i % m == j)))
}

/// Σ M_i, `rows` × `cols`.
fn sum(matrices: &[Matrix], rows: usize, cols: usize) -> Matrix {
    matrices
        .iter()
        .fold(Matrix::zeros(rows, cols), |sum, m| sum.add(m))
}

/// O_d 1: block row i is Σ_{l<i} H_l.
fn lower_block_sums(h: &[Matrix], rows: usize, cols: usize) -> Matrix {
    let blocks: Vec<Matrix> = (0..=h.len()).map(|i| sum(&h[..i], rows, cols)).collect();
    Matrix::vcat(&blocks.iter().collect::<Vec<_>>())
}

/// ‖M‖∞, the largest row sum of |M|.
fn norm_inf(m: &Matrix) -> f64 {
    m.abs_row_sums().iter().copied().fold(0.0, f64::max)
}
