//! Numbers and sets: outward-rounded intervals, differentiable numbers, boxes, zonotopes, ellipsoids.
//!
//! This crate knows no time, no files and no estimator. Everything here is deterministic: the same
//! input gives the same bits on every processor, because products and sums have a fixed order, no
//! multiplication is fused, and transcendental functions come from `libm`.
//!
//! # What "guaranteed" means
//!
//! > **Theorem.** Let an operation on sets be applied to f64 coefficients, and let it return a set, a bound or a
//! > verdict. Then, for these coefficients taken as exact real numbers,
//! >
//! > - a set contains the exact result of the operation on the sets that came in, the rounding boxes r and
//! >   the slacks δ of [`Zonotope`] and [`ConstrainedZonotope`] included;
//! > - a hull contains the set, a support is not below the exact one, a value or derivative over a box contains
//! >   all of them;
//! > - `Empty` and [`Containment::Outside`] are true. `Inside` is true up to the slack that it names. What could
//! >   not be shown is `Undecided`, an error, or a set that is larger.
//! >
//! > Every rounding is carried outward to that end: of products, sums, gains, eliminations, reductions, linear
//! > programs and functions.
//!
//! [`proof`] has the proof, operation by operation, with the tests that hold each rule against exact rational
//! arithmetic. It rests on
//!
//! - IEEE 754 binary64, round to nearest, gradual underflow: no flush to zero, no fused or reordered operation
//!   that the source does not have;
//! - libm's sin, cos, tan and arctan being off by less than one unit in the last place, sampled by tests;
//! - fewer than 2⁴⁰ operations in a row and 2⁵² products an entry.
//!
//! Not covered: what [`Matrix`] computes, whose products round to nearest; factorizations, eigenvalues and the choices that are
//! made with them (a gain, a pivot, an order, a point of expansion may be anything); bare columns
//! (`reduce_columns`, `merge_columns`); vertices, areas and volumes; [`Ellipsoid`] and [`ZonotopicGaussian`], which belong
//! to probabilities; [`se2`] on f64. An enclosure is not claimed to be the smallest one.

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compare with the platform's

pub mod constrained_zonotope;
pub mod containment;
pub mod covariance;
pub mod ellipsoid;
pub mod error;
pub mod interval_matrix;
pub mod interval_vector;
pub mod list;
pub mod lp;
pub mod matrix;
pub mod number;
pub mod ops;
pub mod polytope;
#[doc = include_str!("proof.md")]
pub mod proof {}
pub mod reduction;
pub mod rounding;
pub mod se2;
pub mod strip;
pub mod units;
pub mod zonotope;
pub mod zonotopic_gaussian;

pub use constrained_zonotope::ConstrainedZonotope;
pub use containment::Containment;
pub use ellipsoid::Ellipsoid;
pub use error::SetError;
pub use interval_matrix::IntervalMatrix;
pub use interval_vector::IntervalVector;
pub use list::List;
pub use matrix::Matrix;
pub use number::{Dual, Interval, Real};
pub use polytope::{FacetBound, Frame, Polytope, Slab};
pub use reduction::Reduction;
pub use se2::Se2;
pub use zonotope::Zonotope;
pub use zonotopic_gaussian::ZonotopicGaussian;
