//! Numbers and sets: outward-rounded intervals, differentiable numbers, boxes, zonotopes, ellipsoids.
//!
//! This crate knows no time, no files and no estimator. Everything here is deterministic: the same
//! input gives the same bits on every processor, because products and sums have a fixed order, no
//! multiplication is fused, and transcendental functions come from `libm`.

#![cfg_attr(test, allow(clippy::disallowed_methods))] // tests may compare with the platform's

pub mod constrained_zonotope;
pub mod containment;
pub mod ellipsoid;
pub mod error;
pub mod interval_matrix;
pub mod interval_vector;
pub mod lp;
pub mod matrix;
pub mod number;
pub mod ops;
pub mod polytope;
pub mod reduction;
pub mod rounding;
pub mod se2;
pub mod strip;
pub mod zonotope;
pub mod zonotopic_gaussian;

pub use constrained_zonotope::ConstrainedZonotope;
pub use containment::Containment;
pub use ellipsoid::Ellipsoid;
pub use error::SetError;
pub use interval_matrix::IntervalMatrix;
pub use interval_vector::IntervalVector;
pub use matrix::Matrix;
pub use number::{Dual, Interval, Real};
pub use polytope::{Frame, Polytope, Slab};
pub use reduction::Reduction;
pub use se2::Se2;
pub use zonotope::Zonotope;
pub use zonotopic_gaussian::ZonotopicGaussian;
