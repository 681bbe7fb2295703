//! Exact rational numbers, vectors, matrices, linear programs and sets.

mod cz;
mod draw;
mod lp;
mod matrix;

pub use cz::Cz;
pub use draw::Source;
pub use lp::Lp;
pub use matrix::M;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, Zero};

/// A rational number.
pub type Q = BigRational;
/// A vector of them.
pub type V = Vec<Q>;

/// The whole number `n`.
pub fn q(n: i64) -> Q {
    Q::from_integer(BigInt::from(n))
}

/// n / d, d ≠ 0.
pub fn frac(n: i64, d: i64) -> Q {
    Q::new(BigInt::from(n), BigInt::from(d))
}

/// The whole numbers as a vector.
pub fn v(n: &[i64]) -> V {
    n.iter().map(|&n| q(n)).collect()
}

/// Σ aᵢ bᵢ.
pub fn dot(a: &[Q], b: &[Q]) -> Q {
    a.iter()
        .zip(b)
        .filter(|(a, b)| !a.is_zero() && !b.is_zero())
        .fold(Q::zero(), |s, (a, b)| s + a * b)
}

/// a + b.
pub fn add(a: &[Q], b: &[Q]) -> V {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// a − b.
pub fn sub(a: &[Q], b: &[Q]) -> V {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// f a.
pub fn scale(f: &Q, a: &[Q]) -> V {
    a.iter().map(|a| f * a).collect()
}

/// Σ |aᵢ|.
pub fn norm1(a: &[Q]) -> Q {
    a.iter().fold(Q::zero(), |s, a| s + a.abs())
}

/// The vector as text: (1, −1/2).
pub fn text(a: &[Q]) -> String {
    let parts: Vec<String> = a.iter().map(Q::to_string).collect();
    format!("({})", parts.join(", "))
}
