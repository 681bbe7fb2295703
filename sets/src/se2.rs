//! SE(2): rigid motions of the plane, their Lie algebra, and the maps between them.
//!
//! An element X = [R(θ), x; 0, 1] is kept as (θ, x) with the angle θ not wrapped, so that a vehicle that
//! turns twice has turned by 4π; [`wrap`] gives the angle in (−π, π]. An element ζ = (σ, u) of the Lie
//! algebra stands for [\[σ\]×, u; 0, 0].
//!
//! With sinc s = sin s / s, exp(σ, u) = (σ, V(σ) u) where
//!
//! V(s) = [a, −b; b, a], a = sinc s, b = (1 − cos s)/s = (s/2) sinc²(s/2),
//! V(s)⁻¹ = [h, s/2; −s/2, h], h = (s/2) cot(s/2).
//!
//! In this form nothing cancels near s = 0, so no series is needed there: only the value 1 of sinc and h at
//! 0 itself. All of it is generic over [`Angle`], f64 and [`Interval`]; on intervals every result contains
//! the results at all points.
//!
//! Source: [Li, Appendix A].

use crate::Interval;
use crate::number::Real;
use core::f64::consts::{PI, TAU};

/// A 3 × 3 matrix that acts on (σ, u₁, u₂).
pub type Matrix3<S> = [[S; 3]; 3];

/// A number that angles can be made of.
pub trait Angle: Real {
    /// sin s / s, and 1 at s = 0.
    fn sinc(self) -> Self;
    /// (s/2) cot(s/2), and 1 at s = 0, for |s| < 2π.
    fn half_cot(self) -> Self;
}

impl Angle for f64 {
    fn sinc(self) -> Self {
        if self == 0.0 {
            1.0
        } else {
            libm::sin(self) / self
        }
    }
    fn half_cot(self) -> Self {
        let h = 0.5 * self;
        if h == 0.0 {
            1.0
        } else {
            h * libm::cos(h) / libm::sin(h)
        }
    }
}

/// The least value of sinc, rounded down: sinc(4.4934…).
const LEAST_SINC: f64 = -0.217_233_628_211_222;

impl Angle for Interval {
    /// sinc falls from 1 at 0 to 0 at π; beyond π it lies between its least value and 1/π, as |sin s/s| ≤ 1/s.
    fn sinc(self) -> Self {
        let at = |x: f64| match x {
            0.0 => Self::ONE,
            x => Self::point(x).sin() / Self::point(x),
        };
        let range = |lo: f64, hi: f64| at(lo).hull(&at(hi));
        let s = self.abs();
        if !s.is_finite() {
            return Self::trusted(LEAST_SINC, 1.0);
        }
        if s.hi() <= PI {
            return range(s.lo(), s.hi());
        }
        // PI lies below π, so that 1/PI is above 1/π.
        let beyond = Self::trusted(LEAST_SINC, (Self::ONE / Self::point(PI)).hi());
        if s.lo() <= PI {
            range(s.lo(), PI).hull(&beyond)
        } else {
            let quotient = s.sin() / s;
            quotient.intersect(&beyond).unwrap_or(quotient)
        }
    }
    /// Falls from 1 at 0 to −∞ at 2π; the whole line from 2π on.
    fn half_cot(self) -> Self {
        let at = |x: f64| {
            if x == 0.0 {
                return Self::ONE;
            }
            // Half of the smallest f64 is none: an interval that reaches 0, where the quotient says nothing.
            let h = Self::point(x) * 0.5;
            h * h.cos() / h.sin()
        };
        let s = self.abs();
        if s.hi() >= TAU {
            return Self::ENTIRE;
        }
        at(s.lo()).hull(&at(s.hi()))
    }
}

/// `angle` in (−π, π], up to the rounding of one remainder.
pub fn wrap(angle: f64) -> f64 {
    let wrapped = libm::remainder(angle, TAU);
    if wrapped <= -PI { PI } else { wrapped }
}

/// R(θ) x = [cos θ, −sin θ; sin θ, cos θ] x.
#[inline]
pub fn rotate<S: Real>(theta: S, x: [S; 2]) -> [S; 2] {
    let (c, s) = (theta.cos(), theta.sin());
    [c * x[0] - s * x[1], s * x[0] + c * x[1]]
}

/// (1 − cos s)/s = (s/2) sinc²(s/2), and 0 at s = 0.
#[inline]
pub fn versinc<S: Angle>(s: S) -> S {
    let h = s * 0.5;
    h * h.sinc().sqr()
}

/// V(s) x.
#[inline]
pub fn left_jacobian<S: Angle>(s: S, x: [S; 2]) -> [S; 2] {
    let (a, b) = (s.sinc(), versinc(s));
    [a * x[0] - b * x[1], b * x[0] + a * x[1]]
}

/// V(s)⁻¹ x, for |s| < 2π.
#[inline]
pub fn left_jacobian_inverse<S: Angle>(s: S, x: [S; 2]) -> [S; 2] {
    let (h, half) = (s.half_cot(), s * 0.5);
    [h * x[0] + half * x[1], h * x[1] - half * x[0]]
}

/// ad_ζ, the matrix of ξ ↦ [ζ, ξ]: [0, 0, 0; u₂, 0, −σ; −u₁, σ, 0].
///
/// Source: [Li, Appendix A]. The text beside [Li, Eq. (20)] has ad_u ε = ad_ε u; the bracket is
/// antisymmetric, so that ad_u ε = −ad_ε u.
pub fn ad<S: Real>(zeta: [S; 3]) -> Matrix3<S> {
    let zero = S::constant(0.0);
    let [s, u1, u2] = zeta;
    [[zero; 3], [u2, zero, -s], [-u1, s, zero]]
}

/// An element of SE(2), [R(angle), x; 0, 1], with its angle not wrapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Se2<S = f64> {
    /// θ in rad.
    pub angle: S,
    /// x.
    pub x: [S; 2],
}

impl<S: Real> Se2<S> {
    /// (θ, x).
    pub fn new(angle: S, x: [S; 2]) -> Self {
        Self { angle, x }
    }

    /// The identity.
    pub fn identity() -> Self {
        let zero = S::constant(0.0);
        Self::new(zero, [zero; 2])
    }

    /// X Y = (θ_X + θ_Y, x_X + R(θ_X) x_Y).
    pub fn compose(self, other: Self) -> Self {
        let moved = rotate(self.angle, other.x);
        Self::new(
            self.angle + other.angle,
            [self.x[0] + moved[0], self.x[1] + moved[1]],
        )
    }

    /// X⁻¹ = (−θ, −R(−θ) x).
    pub fn inverse(self) -> Self {
        let back = rotate(-self.angle, self.x);
        Self::new(-self.angle, [-back[0], -back[1]])
    }

    /// [R(θ), x; 0, 1].
    pub fn matrix(self) -> Matrix3<S> {
        let (c, s) = (self.angle.cos(), self.angle.sin());
        let (zero, one) = (S::constant(0.0), S::constant(1.0));
        [[c, -s, self.x[0]], [s, c, self.x[1]], [zero, zero, one]]
    }

    /// Ad_X, the matrix of ξ ↦ log(X exp(ξ) X⁻¹): first column (1, x₂, −x₁), lower right block R(θ).
    pub fn adjoint(self) -> Matrix3<S> {
        let (c, s) = (self.angle.cos(), self.angle.sin());
        let (zero, one) = (S::constant(0.0), S::constant(1.0));
        [[one, zero, zero], [self.x[1], c, -s], [-self.x[0], s, c]]
    }
}

impl<S: Angle> Se2<S> {
    /// exp(σ, u) = (σ, V(σ) u).
    pub fn exp(zeta: [S; 3]) -> Self {
        let [s, u1, u2] = zeta;
        Self::new(s, left_jacobian(s, [u1, u2]))
    }

    /// log X = (θ, V(θ)⁻¹ x), for |θ| < 2π.
    ///
    /// The inverse of [`Se2::exp`] for the angle as it stands. On the group itself, where angles that differ
    /// by 2π are one, exp is one-to-one only for |θ| < π: exp(2π, 0, 0) is the identity. Whoever wants the
    /// principal logarithm wraps the angle first.
    pub fn log(self) -> [S; 3] {
        let u = left_jacobian_inverse(self.angle, self.x);
        [self.angle, u[0], u[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in (−1, 1) without pattern, the same every time.
    struct Draws(u64);

    impl Draws {
        fn signed(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
        fn algebra(&mut self, angle: f64, length: f64) -> [f64; 3] {
            [
                angle * self.signed(),
                length * self.signed(),
                length * self.signed(),
            ]
        }
        fn group(&mut self) -> Se2 {
            let [a, x, y] = self.algebra(3.0, 20.0);
            Se2::new(a, [x, y])
        }
    }

    fn apply(m: Matrix3<f64>, x: [f64; 3]) -> [f64; 3] {
        core::array::from_fn(|i| (0..3).map(|j| m[i][j] * x[j]).sum())
    }

    fn product(a: Matrix3<f64>, b: Matrix3<f64>) -> Matrix3<f64> {
        core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
    }

    fn distance(a: Se2, b: Se2) -> f64 {
        (a.angle - b.angle)
            .abs()
            .max((a.x[0] - b.x[0]).abs())
            .max((a.x[1] - b.x[1]).abs())
    }

    /// f(X, u) = X exp(δ u).
    fn forward(x: Se2, u: [f64; 3]) -> Se2 {
        x.compose(Se2::exp(u))
    }

    #[test]
    fn exp_agrees_with_the_power_series_of_the_matrix() {
        let mut draws = Draws(1);
        for scale in [1e-12, 1e-6, 1e-3, 0.5, 3.0] {
            let [s, u1, u2] = draws.algebra(scale, 2.0);
            let zeta = [[0.0, -s, u1], [s, 0.0, u2], [0.0; 3]];
            let mut term: Matrix3<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let mut sum = term;
            for k in 1..40 {
                term = product(term, zeta).map(|row| row.map(|x| x / f64::from(k)));
                for (row, t) in sum.iter_mut().zip(term) {
                    row.iter_mut().zip(t).for_each(|(x, t)| *x += t);
                }
            }
            let ours = Se2::exp([s, u1, u2]).matrix();
            for (a, b) in ours.iter().flatten().zip(sum.iter().flatten()) {
                assert!((a - b).abs() < 1e-14, "{s}: {a} {b}");
            }
        }
    }

    #[test]
    fn log_is_the_inverse_of_exp_at_every_scale_of_the_angle() {
        let mut draws = Draws(2);
        for k in 0..2000 {
            let angle = [0.0, 1e-300, 1e-9, 1e-4, 1.0, 3.1][k % 6];
            let zeta = draws.algebra(angle, 5.0);
            let back = Se2::exp(zeta).log();
            for (a, b) in back.iter().zip(zeta) {
                assert!((a - b).abs() < 1e-14 * 40.0, "{zeta:?} {back:?}");
            }
        }
        assert_eq!(Se2::exp([0.0, 1.0, 2.0]), Se2::new(0.0, [1.0, 2.0]));
    }

    #[test]
    fn an_element_times_its_inverse_is_the_identity_and_matrices_multiply() {
        let mut draws = Draws(3);
        for _ in 0..500 {
            let (x, y) = (draws.group(), draws.group());
            assert!(distance(x.compose(x.inverse()), Se2::identity()) < 1e-13);
            let (a, b) = (product(x.matrix(), y.matrix()), x.compose(y).matrix());
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((a - b).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn the_vehicle_is_group_affine() {
        // f(X Y, u) = f(X, u) f(I, u)⁻¹ f(Y, u). [Li, Eq. (1)]
        let mut draws = Draws(4);
        for _ in 0..500 {
            let (x, y, u) = (draws.group(), draws.group(), draws.algebra(1.0, 1.0));
            let left = forward(x.compose(y), u);
            let right = forward(x, u)
                .compose(forward(Se2::identity(), u).inverse())
                .compose(forward(y, u));
            assert!(distance(left, right) < 2e-14 * 20.0);
        }
    }

    #[test]
    fn the_adjoint_moves_an_error_through_a_step_exactly() {
        // exp(−δu) exp(ξ) exp(δu) = exp(Ad_{exp(−δu)} ξ), without a remainder. [Li, Lemma 2.1]
        let mut draws = Draws(5);
        let mut first_order: f64 = 0.0;
        for _ in 0..500 {
            let (xi, u) = (draws.algebra(3.0, 3.0), draws.algebra(0.5, 1.0));
            let back = Se2::exp(u.map(|x| -x));
            let moved = back.compose(Se2::exp(xi)).compose(Se2::exp(u));
            assert!(distance(moved, Se2::exp(apply(back.adjoint(), xi))) < 1e-14 * 10.0);
            // The paper's A = I − δ ad_u is its first-order part. [Li, Appendix C]
            let ad = ad(u);
            for (i, row) in back.adjoint().iter().enumerate() {
                for (j, x) in row.iter().enumerate() {
                    first_order = first_order.max((x - (f64::from(i == j) - ad[i][j])).abs());
                }
            }
        }
        assert!(
            first_order > 0.01,
            "large steps tell the two apart: {first_order}"
        );
    }

    #[test]
    fn ad_is_the_commutator_and_antisymmetric() {
        let mut draws = Draws(6);
        let hat = |z: [f64; 3]| [[0.0, -z[0], z[1]], [z[0], 0.0, z[2]], [0.0; 3]];
        for _ in 0..200 {
            let (x, y) = (draws.algebra(3.0, 3.0), draws.algebra(3.0, 3.0));
            let bracket = apply(ad(x), y);
            let (xy, yx) = (product(hat(x), hat(y)), product(hat(y), hat(x)));
            for (i, row) in hat(bracket).iter().enumerate() {
                for (j, &b) in row.iter().enumerate() {
                    assert!((b - (xy[i][j] - yx[i][j])).abs() < 1e-14 * 10.0);
                }
            }
            for (a, b) in apply(ad(x), y).iter().zip(apply(ad(y), x)) {
                assert_eq!(*a, -b);
            }
        }
    }

    #[test]
    fn on_intervals_every_point_is_enclosed() {
        let mut draws = Draws(7);
        for k in 0..3000 {
            let width = [0.0, 1e-9, 0.1, 2.0][k % 4];
            let center = draws.algebra(4.0, 5.0);
            let sides = center.map(|c| Interval::new(c - width, c + width).unwrap());
            let point = core::array::from_fn(|i| center[i] + width * draws.signed());
            let (image, x) = (Se2::exp(sides), Se2::exp(point));
            // The point itself is rounded: room of 1e-14.
            let near = |side: Interval, x: f64| side.lo() - 1e-14 <= x && x <= side.hi() + 1e-14;
            assert!(
                near(image.x[0], x.x[0]) && near(image.x[1], x.x[1]),
                "{sides:?} {point:?}"
            );
            let back = left_jacobian_inverse(sides[0], [sides[1], sides[2]]);
            let [_, u1, u2] = Se2::new(point[0], [point[1], point[2]]).log();
            let near = |side: Interval, x: f64| side.lo() - 1e-12 <= x && x <= side.hi() + 1e-12;
            assert!(
                near(back[0], u1) && near(back[1], u2),
                "{sides:?} {point:?}"
            );
            if width == 0.0 {
                assert!(image.x[0].width() < 1e-13, "{image:?}");
            }
        }
        let wide = Interval::new(-1.0, 3.0).unwrap();
        assert!(wide.sinc().hi() == 1.0 && (wide.sinc().lo() - libm::sin(3.0) / 3.0).abs() < 1e-15);
        assert_eq!(
            Interval::new(-7.0, 0.0).unwrap().half_cot(),
            Interval::ENTIRE
        );
    }

    #[test]
    fn sinc_beyond_pi_rises_again_and_half_cot_beside_0_is_below_1() {
        // sinc has its second maximum, 0.1284, near 7.7253.
        for (lo, hi) in [(3.125, 8.0), (6.0, 8.0), (-8.0, -7.0), (7.0, 9.0)] {
            let range = Interval::new(lo, hi).unwrap().sinc();
            for i in 0..=1000 {
                let s = lo + (hi - lo) * f64::from(i) / 1000.0;
                let value = libm::sin(s) / s;
                assert!(
                    range.lo() - 1e-15 <= value && value <= range.hi() + 1e-15,
                    "[{lo}, {hi}]: {range:?} {value}"
                );
            }
        }
        // h cot h < 1 for every h but 0, and halving the smallest f64 gives 0.
        for s in [f64::from_bits(1), f64::from_bits(3), 1e-200] {
            assert!(Interval::point(s).half_cot().lo() < 1.0, "{s:e}");
        }
    }

    #[test]
    fn wrapped_angles_lie_in_the_half_open_interval() {
        assert_eq!(wrap(0.0), 0.0);
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - TAU)).abs() < 1e-15);
        assert!((wrap(-100.0) - (16.0 * TAU - 100.0)).abs() < 1e-13);
    }
}
