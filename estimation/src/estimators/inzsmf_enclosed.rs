//! The InZSMF that keeps its remainder: a set on SE(2) that is proved to hold the truth.
//!
//! [Li, Theorem 3.1] writes the error as a logarithm, which makes the vehicle's own motion exactly linear
//! and the measurement nonlinear: y − x̂ = R(θ̂) V(σ) u + v. What it drops there, L (V(σ) − I) u, is as large as
//! L v where the set is a few metres wide, and it feeds back on itself through the heading. The same
//! left-invariant error X̂⁻¹ X = (σ, p) without the logarithm ([`Coordinates::Body`]) has it the other
//! way round: y − x̂ = R(θ̂) p + v is exactly linear, the heading's recursion is too, and what is left over
//! is the bend of the way of one step, (R(σ) − I) t with |t| = δν, which cannot feed back on the heading.
//!
//! With G(u, 0) = (φ, t), the next estimate X̂⁺ any f64 numbers, α = θ̂ − θ̂⁺, z = y − x̂ and any f64 gain L
//! (3 × rows of y, in the world's axes), every truth that agrees with the measurement has, exactly,
//!
//! σ⁺ = σ + δ w_θ + (α + φ) + L₁ z − L₁ R(θ̂) p − L₁ v,
//! p⁺ = R(α) \[p + (R(σ) − I) t + R(σ) (t(w) − t)\] + R(−θ̂⁺) (x̂ + R(θ̂) t − x̂⁺) + L₂ z − L₂ R(θ̂) p − L₂ v,
//!
//! where t(w) is the way of G(u, w): the terms L z and −L (R(θ̂) p + v) add up to zero. With |σ| ≤ h on the set,
//!
//! (R(σ) − I) t = sin σ J t + (cos σ − 1) t, sin σ = κ σ ± b, cos σ − 1 = −m ± m,
//!
//! κ = 2 J₁(h)/h being close to the best slope, and the noise turned by the unknown σ is that turned by
//! nothing and a small box. So that
//!
//! H⁺ = \[M H̄, D_w H_w, −L H_v, b R(α) J t, m R(α) t, box\], M = [1, −L₁ R(θ̂); κ R(α) J t, R(α) − L₂ R(θ̂)].
//!
//! All of it is evaluated in intervals; midpoints become f64 coefficients, radii the rounding box, which is
//! folded into generators at the end of the step.

use super::pose_zonotope::{Coordinates, PoseZonotope};
use super::vehicle_filter::{
    Innovation, PoseGain, PoseReduction, Transient, VehicleFilter, gram, times,
};
use crate::EstimationError;
use crate::estimator::Measurement;
use crate::systems::Form;
use crate::systems::vehicle_se2::sinc;
use core::f64::consts::{FRAC_PI_2, PI};
use zonobench_sets::matrix::dot;
use zonobench_sets::number::Real;
use zonobench_sets::reduction::{combastel, girard};
use zonobench_sets::se2::{Angle, Matrix3, Se2, rotate};
use zonobench_sets::zonotope::Zonotope;
use zonobench_sets::{Interval, IntervalMatrix, List, Matrix, SetError};

/// The recursion with its remainder enclosed; see the module.
///
/// The prior is the zonotope of the problem *in the state space*, which the coordinates hold exactly. The
/// filter refuses to go on where the headings reach half a turn, since such a set says nothing of the
/// heading. A measurement that no pose of the set agrees with is [`EstimationError::Inconsistent`].
#[derive(Clone, Debug)]
pub struct Enclosed {
    /// Half-widths of H_w, rounded up.
    w: [Interval; 3],
    /// Half-widths of H_v, rounded up.
    v: [f64; 2],
}

/// |w| ≤ `r`, as the interval \[0, r\]'s upper end.
fn upper(x: Interval) -> Interval {
    Interval::point(x.mag())
}

impl Enclosed {
    /// Moves the prior of `filter` to the coordinates of this recursion.
    ///
    /// Fails where its headings reach π, or on overflow.
    pub(super) fn new(filter: &mut VehicleFilter) -> Result<Self, EstimationError> {
        let prior = &filter.prior;
        let back = block(Interval::ONE, frame(-Interval::point(prior.pose.angle)));
        let error = prior
            .error
            .interval_map(&back)
            .map_err(EstimationError::at(0, "prior in the vehicle's axes"))?
            .fold();
        check_headings(filter.kind, 0, &error)?;
        filter.prior = PoseZonotope::new(prior.pose, error, Coordinates::Body);
        let radius = |g: &Matrix| {
            Zonotope::new(vec![0.0; g.rows()], g.clone())
                .map(|z| z.radius())
                .map_err(EstimationError::at(0, "noise"))
        };
        let (w, v) = (radius(&filter.hw)?, radius(&filter.hv)?);
        Ok(Self {
            w: [0, 1, 2].map(|i| Interval::point(w[i])),
            v: [v[0], v[1]],
        })
    }

    /// Fails with `Inconsistent` where y_k ∉ x̂ + R(θ̂) p + v for every p of the set and v of V.
    pub(super) fn check_consistency(
        &self,
        k: usize,
        belief: &PoseZonotope,
        y: Measurement,
    ) -> Result<(), EstimationError> {
        let hull = belief
            .enclosure()
            .map_err(EstimationError::at(k, "hull of the set"))?;
        for i in 0..2 {
            let Some(y) = y[i] else { continue };
            let expected = hull[i + 1] + Interval::from_center_radius(0.0, self.v[i]);
            if !expected.contains(y) {
                return Err(EstimationError::Inconsistent { k });
            }
        }
        Ok(())
    }

    /// An enclosure of at most s generators, by a reduction that rounds outward.
    pub(super) fn reduce_order(
        &self,
        filter: &VehicleFilter,
        k: usize,
        belief: PoseZonotope,
    ) -> Result<PoseZonotope, EstimationError> {
        let s = filter.settings.generators;
        let error = match filter.settings.reduction {
            PoseReduction::Girard => girard::reduce_scaled(&belief.error, s),
            PoseReduction::Outer | PoseReduction::PaperTables => {
                let reduce = |z: &Zonotope| combastel::reduce(z, s);
                filter.units.zonotope(&belief.error, reduce)
            }
        };
        let error = error.map_err(EstimationError::at(k, "reduction"))?;
        Ok(PoseZonotope { error, ..belief })
    }

    /// The set at `k` from the reduced one at k − 1, u_{k−1} and y_{k−1}.
    pub(super) fn step(
        &self,
        filter: &VehicleFilter,
        k: usize,
        belief: &PoseZonotope,
        u: &[f64],
        y: Measurement,
    ) -> Result<PoseZonotope, EstimationError> {
        let (pose, error) = (belief.pose, &belief.error);
        let motion = filter.system.motion(u);
        // The gain may be anything; this one is that of the linear filter, which agrees to first order.
        let ahead = Se2::new(motion.angle.mid(), motion.x.map(|x| x.mid()));
        let a = ahead.inverse().adjoint();
        let p = gram(error.g());
        let innovation = filter.world_innovation(&pose, &belief.to_state(), y);
        let (l, rows) = match &innovation {
            None => (Matrix::zeros(3, 0), Vec::new()),
            Some(innovation) => {
                let used = belief
                    .earlier
                    .as_ref()
                    .filter(|_| filter.settings.transient == Transient::Lag)
                    .unwrap_or(&p);
                let l = sound_gain(filter, k, &a, used, innovation, u[1])?;
                let l = match filter.settings.gain {
                    PoseGain::FRadius => l,
                    // The closed form is for z in the vehicle's axes.
                    PoseGain::Poles(_) => in_the_world(&l, pose.angle),
                };
                (l, innovation.rows.clone())
            }
        };
        let z: Vec<Interval> = rows
            .iter()
            .filter_map(|&i| Some(Interval::point(y[i]?) - pose.x[i]))
            .collect();
        let correction = times(&l, &z.iter().map(|z| z.mid()).collect::<Vec<_>>());
        let next = pose.compose(ahead).compose(Se2::exp(correction));
        let terms = Terms {
            heading: Interval::point(pose.angle),
            alpha: Interval::point(pose.angle) - next.angle,
            motion,
            l: &l,
            rows: &rows,
            bend: Bend::over(headings(error)),
        };
        let linear = error.interval_map(&terms.linear_part());
        let rest = self.rest(filter, &terms, &pose, &next, &z);
        let set = linear
            .and_then(|linear| linear.minkowski_sum(&rest?))
            .map_err(EstimationError::at(k, "step"))?
            .fold();
        check_headings(filter.kind, k, &set)?;
        Ok(PoseZonotope {
            earlier: Some(p),
            ..PoseZonotope::new(next, set, Coordinates::Body)
        })
    }

    /// Everything but M H̄: center and generators of noises, bends and constants.
    fn rest(
        &self,
        filter: &VehicleFilter,
        terms: &Terms,
        pose: &Se2,
        next: &Se2,
        z: &[Interval],
    ) -> Result<Zonotope, SetError> {
        let Terms {
            heading,
            alpha,
            motion,
            l,
            bend,
            ..
        } = terms;
        let turned = |x: [Interval; 2]| rotate(*alpha, x);
        // (α + φ) + L₁ z, and R(−θ̂⁺) (x̂ + R(θ̂) t − x̂⁺) + L₂ z − m R(α) t
        let way = rotate(*heading, motion.x);
        let apart = [0, 1].map(|i| way[i] + pose.x[i] - next.x[i]);
        let apart = rotate(-Interval::point(next.angle), apart);
        let along = turned(motion.x);
        let across = turned([-motion.x[1], motion.x[0]]);
        let lz = |i: usize| (0..z.len()).fold(Interval::ZERO, |s, r| s + z[r] * l[(i, r)]);
        let offset = [
            *alpha + motion.angle + lz(0),
            apart[0] + lz(1) - along[0] * bend.cosine,
            apart[1] + lz(2) - along[1] * bend.cosine,
        ];
        let zero = Interval::ZERO;
        let mut columns: Vec<[Interval; 3]> = Vec::new();
        // D_w H_w
        let dt = filter.system.dt();
        let noise_turn = match filter.system.form() {
            Form::Euler => *alpha,
            Form::Group => *alpha + motion.angle,
        };
        let hw = &filter.hw;
        for j in 0..hw.cols() {
            let [s, w1, w2] = [0, 1, 2].map(|i| Interval::point(hw[(i, j)]) * dt);
            let [x, y] = rotate(noise_turn, [w1, w2]);
            columns.push([s, x, y]);
        }
        // −L H_v
        let hv = &filter.hv;
        for j in 0..hv.cols() {
            let entry = |i: usize| {
                let sum = terms.rows.iter().enumerate().fold(zero, |s, (r, &row)| {
                    s + Interval::point(hv[(row, j)]) * l[(i, r)]
                });
                -sum
            };
            columns.push([entry(0), entry(1), entry(2)]);
        }
        columns.push([zero, across[0] * bend.sine, across[1] * bend.sine]);
        columns.push([zero, along[0] * bend.cosine, along[1] * bend.cosine]);
        let [x, y] = self.turned_noise(filter.system.form(), dt, bend, noise_turn);
        columns.push([zero, x, zero]);
        columns.push([zero, zero, y]);

        let mid = Matrix::from_fn(3, columns.len(), |i, j| columns[j][i].mid());
        let radius: List<f64> = (0..3)
            .map(|i| {
                let start = Interval::point(offset[i].rad());
                let sum = columns
                    .iter()
                    .fold(start, |s, c| s + Interval::point(c[i].rad()));
                sum.hi()
            })
            .collect();
        Zonotope::with_rounding(offset.map(|x| x.mid()).to_vec(), mid, radius)
    }

    /// Half-widths of R(α) R(σ) (t(w) − t) less its part that is linear in w.
    ///
    /// By Euler's rule t(w) − t = δ w_u, and R(σ) w_u − w_u is left over. On the group t(w) − t =
    /// R(φ) V(δ w_θ) δ w_u, and R(φ) \[(R(σ) − I) V(δ w_θ) + (V(δ w_θ) − I)\] δ w_u is.
    fn turned_noise(&self, form: Form, dt: f64, bend: &Bend, turn: Interval) -> [Interval; 2] {
        let [s, w1, w2] = self.w.map(|w| upper(w * dt));
        // |(R(σ) − I) x| for |x| ≤ (x1, x2)
        let by_heading = |x: [Interval; 2]| {
            [
                bend.least_cosine * x[0] + bend.greatest_sine * x[1],
                bend.greatest_sine * x[0] + bend.least_cosine * x[1],
            ]
        };
        let rest = match form {
            Form::Euler => by_heading([w1, w2]),
            Form::Group => {
                // |b| = |1 − cos s|/|s| ≤ |s|/2; and the same of the polynomial that the model has for sinc.
                let around = s.hull(&-s);
                let half = around * 0.5;
                let (exact, model) = (around.sinc(), sinc(around));
                let a = upper(Interval::ONE - exact.hull(&model));
                let b = upper(half.hull(&(half * sinc(half).sqr())));
                let by_v = [a * w1 + b * w2, b * w1 + a * w2];
                let turned = by_heading([w1 + by_v[0], w2 + by_v[1]]);
                [turned[0] + by_v[0], turned[1] + by_v[1]]
            }
        };
        let (c, s) = (turn.cos().abs(), turn.sin().abs());
        [
            upper(c * rest[0] + s * rest[1]),
            upper(s * rest[0] + c * rest[1]),
        ]
    }
}

/// The filter's gain or, where its S = C P Cᵀ + Q_v is singular up to rounding, the gain of the one component of y whose
/// variance is larger, and 0 where neither has any. The set is right for every gain.
///
/// With [`Transient::Lag`] P is that of the step before, which may be long and thin, or far from its successor.
fn sound_gain(
    filter: &VehicleFilter,
    k: usize,
    a: &Matrix3<f64>,
    p: &Matrix3<f64>,
    innovation: &Innovation,
    speed: f64,
) -> Result<Matrix, EstimationError> {
    match filter.gain(k, a, p, innovation, speed) {
        Ok(l) if l.is_finite() => return Ok(l),
        Ok(_) | Err(EstimationError::Singular { .. }) => {}
        Err(other) => return Err(other),
    }
    let count = innovation.rows.len();
    let variance = |r: usize| {
        let c = innovation.c.row(r);
        let along: f64 = (0..3)
            .map(|i| c[i] * (0..3).map(|j| p[i][j] * c[j]).sum::<f64>())
            .sum();
        along + dot(innovation.hv.row(r), innovation.hv.row(r))
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&r, &s| variance(s).total_cmp(&variance(r)));
    let alone = |r: usize| Innovation {
        rows: vec![innovation.rows[r]],
        z: vec![innovation.z[r]],
        c: Matrix::from_fn(1, 3, |_, j| innovation.c[(r, j)]),
        hv: Matrix::from_fn(1, innovation.hv.cols(), |_, j| innovation.hv[(r, j)]),
    };
    let found = order.into_iter().find_map(|r| {
        let l = filter.gain(k, a, p, &alone(r), speed).ok()?;
        l.is_finite().then_some((r, l))
    });
    Ok(Matrix::from_fn(3, count, |i, j| match &found {
        Some((r, l)) if *r == j => l[(i, 0)],
        _ => 0.0,
    }))
}

/// The numbers of one step.
struct Terms<'a> {
    /// θ̂.
    heading: Interval,
    /// α = θ̂ − θ̂⁺.
    alpha: Interval,
    /// G(u, 0) = (φ, t).
    motion: Se2<Interval>,
    /// L, 3 × rows, in the world's axes.
    l: &'a Matrix,
    /// The components of y that it reads.
    rows: &'a [usize],
    bend: Bend,
}

impl Terms<'_> {
    /// M = [1, −L₁ R(θ̂); κ R(α) J t, R(α) − L₂ R(θ̂)].
    fn linear_part(&self) -> IntervalMatrix {
        let world = frame(self.heading);
        let lr = |i: usize, j: usize| {
            self.rows
                .iter()
                .enumerate()
                .fold(Interval::ZERO, |s, (r, &row)| {
                    s + world[row][j] * self.l[(i, r)]
                })
        };
        let turned = frame(self.alpha);
        let across = rotate(self.alpha, [-self.motion.x[1], self.motion.x[0]]);
        IntervalMatrix::from_fn(3, 3, |i, j| match (i, j) {
            (0, 0) => Interval::ONE,
            (0, j) => -lr(0, j - 1),
            (i, 0) => across[i - 1] * self.bend.slope,
            (i, j) => turned[i - 1][j - 1] - lr(i, j - 1),
        })
    }
}

/// sin σ and cos σ over |σ| ≤ h.
struct Bend {
    /// κ.
    slope: f64,
    /// b with |sin σ − κ σ| ≤ b.
    sine: Interval,
    /// m with |cos σ − 1 + m| ≤ m.
    cosine: Interval,
    /// An upper bound on |sin σ|.
    greatest_sine: Interval,
    /// An upper bound on 1 − cos σ.
    least_cosine: Interval,
}

impl Bend {
    /// For 0 ≤ h < π.
    ///
    /// f(σ) = sin σ − κ σ is odd, and concave on [0, π]: there it lies above min(0, f(h)) and below the tangent
    /// at any point s, hence below f(s) + |f′(s)| h; s = arccos κ makes that small.
    fn over(h: f64) -> Self {
        // The slope of the Chebyshev projection of sin on [−h, h]; any other would be sound too.
        let slope = if h > 0.0 {
            (2.0 * libm::j1(h) / h).min(1.0)
        } else {
            1.0
        };
        let f = |s: Interval| s.sin() - s * slope;
        let top = Interval::point(libm::acos(slope).min(h));
        let end = Interval::point(h);
        let tangent = f(top) + upper(top.cos() - slope) * end;
        let least_cosine = upper(Interval::ONE - end.cos());
        let greatest_sine = if h < FRAC_PI_2 {
            upper(end.sin())
        } else {
            Interval::ONE
        };
        Self {
            slope,
            sine: Interval::point(f(end).mag().max(tangent.mag())),
            cosine: least_cosine * 0.5,
            greatest_sine,
            least_cosine,
        }
    }
}

/// R(θ).
fn frame(theta: Interval) -> [[Interval; 2]; 2] {
    let (c, s) = (theta.cos(), theta.sin());
    [[c, -s], [s, c]]
}

/// diag(a, B).
fn block(a: Interval, b: [[Interval; 2]; 2]) -> IntervalMatrix {
    IntervalMatrix::from_fn(3, 3, |i, j| match (i, j) {
        (0, 0) => a,
        (0, _) | (_, 0) => Interval::ZERO,
        (i, j) => b[i - 1][j - 1],
    })
}

/// L R(θ̂)ᵀ.
fn in_the_world(l: &Matrix, angle: f64) -> Matrix {
    let (c, s) = (libm::cos(angle), libm::sin(angle));
    Matrix::from_fn(3, 2, |i, j| match j {
        0 => c * l[(i, 0)] - s * l[(i, 1)],
        _ => s * l[(i, 0)] + c * l[(i, 1)],
    })
}

/// h with |σ| ≤ h on the set.
fn headings(error: &Zonotope) -> f64 {
    (Interval::point(error.radius()[0]) + error.c()[0].abs()).hi()
}

/// Refuses a set whose headings reach π.
fn check_headings(kind: &'static str, k: usize, error: &Zonotope) -> Result<(), EstimationError> {
    let half_width = headings(error);
    if half_width < PI {
        return Ok(());
    }
    Err(EstimationError::Refused {
        k,
        kind,
        reason: format!(
            "the heading's half-width {half_width:.3} rad has reached pi, so that the set says nothing of \
             the heading; a narrower prior, more generators or reduction = \"girard\" may keep it below"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_and_the_constant_bound_sine_and_cosine() {
        for h in [0.0, 1e-9, 0.1, 0.7, 1.6, 2.5, 3.1] {
            let bend = Bend::over(h);
            let (mut sine, mut cosine): (f64, f64) = (0.0, 0.0);
            for i in 0..=2000 {
                let s = h * f64::from(i) / 2000.0;
                sine = sine.max((libm::sin(s) - bend.slope * s).abs());
                let m = bend.cosine.hi();
                cosine = cosine.max((libm::cos(s) - 1.0 + m).abs() - m);
                assert!(libm::sin(s).abs() <= bend.greatest_sine.hi());
                assert!(1.0 - libm::cos(s) <= bend.least_cosine.hi());
            }
            let bound = bend.sine.hi();
            assert!(
                sine <= bound && cosine <= 1e-15,
                "{h}: {sine} {bound} {cosine}"
            );
            // Close to the best line, whose error is h³/24 for small h.
            if (0.1..1.0).contains(&h) {
                assert!(bound < 1.2 * h * h * h / 24.0, "{h}: {bound}");
            }
        }
    }
}
