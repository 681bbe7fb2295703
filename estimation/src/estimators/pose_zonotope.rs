//! What the set-membership filters of a vehicle know: a pose, and a zonotope of errors about it.
//!
//! The filters differ in the coordinates of the error, [`Coordinates`]; the questions asked of a belief are
//! the same, and are answered here for all of them.

use crate::estimator::{Belief, Containment, Extra, Shape, Size};
use zonobench_sets::number::Real;
use zonobench_sets::se2::{Matrix3, Se2, left_jacobian, left_jacobian_inverse, rotate};
use zonobench_sets::zonotope::Zonotope;
use zonobench_sets::{Interval, IntervalMatrix, IntervalVector, Matrix, SetError};

/// The coordinates of the error between the true pose X = (θ, x) and the estimate X̂ = (θ̂, x̂).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// (θ − θ̂, x − x̂).
    State,
    /// log(X̂⁻¹ X), the left-invariant error.
    Left,
    /// log(X X̂⁻¹), the right-invariant error.
    Right,
    /// (σ, p) = (θ − θ̂, R(θ̂)ᵀ (x − x̂)): X̂⁻¹ X = (σ, p), the left-invariant error without its logarithm.
    /// p = V(σ) u for log(X̂⁻¹ X) = (σ, u), so that both agree to first order.
    Body,
}

/// { X : the error of X about `pose`, in `coordinates`, lies in `error` }.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseZonotope {
    /// X̂, with θ̂ not wrapped.
    pub pose: Se2,
    /// The set of errors (heading first).
    pub error: Zonotope,
    /// In which coordinates.
    pub coordinates: Coordinates,
    /// y_k, which the filters use in the step from k to k + 1.
    pub(super) pending: Option<Vec<Option<f64>>>,
    /// H̄ H̄ᵀ of the step before, for a gain that lags.
    pub(super) earlier: Option<Matrix3<f64>>,
}

impl PoseZonotope {
    /// { X̂ } with the errors ⟨0, H⟩, before any measurement.
    pub fn new(pose: Se2, error: Zonotope, coordinates: Coordinates) -> Self {
        Self {
            pose,
            error,
            coordinates,
            pending: None,
            earlier: None,
        }
    }

    /// D with (θ − θ̂, x − x̂) = D ε + O(ε²): the identity, diag(1, R(θ̂)), or [1, 0; J x̂, I] with
    /// J = [0, −1; 1, 0]. Exact for `State` and `Body`.
    pub fn to_state(&self) -> Matrix3<f64> {
        let (c, s) = (libm::cos(self.pose.angle), libm::sin(self.pose.angle));
        match self.coordinates {
            Coordinates::State => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Coordinates::Left | Coordinates::Body => [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
            Coordinates::Right => {
                let [x1, x2] = self.pose.x;
                [[1.0, 0.0, 0.0], [-x2, 1.0, 0.0], [x1, 0.0, 1.0]]
            }
        }
    }

    /// D G: the generators of the first-order set in the state space, rounded to nearest.
    pub fn state_generators(&self) -> Matrix {
        match self.coordinates {
            Coordinates::State => self.error.g().clone(),
            _ => product(&self.to_state(), self.error.g()),
        }
    }

    /// The generators of the positions in the vehicle's axes, R(θ̂)ᵀ (x − x̂) to first order, 2 × p.
    pub fn body_generators(&self) -> Matrix {
        let g = self.error.g();
        match self.coordinates {
            Coordinates::Left | Coordinates::Body => {
                Matrix::from_fn(2, g.cols(), |i, j| g[(i + 1, j)])
            }
            Coordinates::State | Coordinates::Right => {
                let world = self.state_generators();
                let (c, s) = (libm::cos(self.pose.angle), libm::sin(self.pose.angle));
                let rows = [[c, s], [-s, c]];
                Matrix::from_fn(2, g.cols(), |i, j| {
                    rows[i][0] * world[(1, j)] + rows[i][1] * world[(2, j)]
                })
            }
        }
    }

    /// Half-widths of the set along the vehicle's axes, to first order.
    pub fn body_half_widths(&self) -> [f64; 2] {
        let sums = self.body_generators().abs_row_sums();
        [sums[0], sums[1]]
    }

    /// The exact area of the first-order set of positions: that of the zonogon of the projected generators.
    pub fn projected_area(&self) -> f64 {
        Zonotope::new(vec![0.0; 2], self.body_generators())
            .ok()
            .and_then(|z| z.volume())
            .unwrap_or(f64::NAN)
    }

    /// A box that holds every (θ, x) of the set itself, which is curved in the coordinates `Left` and `Right`:
    /// X̂ exp(ε) or exp(ε) X̂ with ε an interval, evaluated on the interval hull of the errors.
    ///
    /// θ is the heading as it stands, not wrapped. Rounded outward. Fails where the hull is not finite.
    pub fn enclosure(&self) -> Result<IntervalVector, SetError> {
        let hull = self.error.interval_hull()?;
        let (angle, x) = (self.pose.angle, self.pose.x.map(Interval::point));
        let heading = Interval::point(angle);
        let offset = match self.coordinates {
            Coordinates::State => [hull[1], hull[2]],
            Coordinates::Left => rotate(heading, left_jacobian(hull[0], [hull[1], hull[2]])),
            Coordinates::Body => {
                let (c, s) = (heading.cos(), heading.sin());
                let turn = IntervalMatrix::from_fn(2, 3, |i, j| match (i, j) {
                    (_, 0) => Interval::ZERO,
                    (0, 1) | (1, 2) => c,
                    (0, _) => -s,
                    _ => s,
                });
                let sides = self.error.interval_map(&turn)?.interval_hull()?;
                [sides[0], sides[1]]
            }
            Coordinates::Right => {
                // R(σ) x̂ − x̂ + V(σ) u = V(σ) (σ J x̂ + u)
                let way = [hull[1] - hull[0] * x[1], hull[2] + hull[0] * x[0]];
                left_jacobian(hull[0], way)
            }
        };
        IntervalVector::new(vec![hull[0] + angle, offset[0] + x[0], offset[1] + x[1]])
            .finite("enclosure of a set of poses")
    }

    /// The error of the poses in the box `x`, with its heading in (−π, π].
    ///
    /// Headings that differ by 2π are one pose, so that this is the error with the least heading.
    fn error_of(&self, x: &[Interval]) -> [Interval; 3] {
        let pose = self.pose;
        let turn = x[0] - pose.angle;
        let full = Interval::ONE.atan() * 8.0;
        let sigma = turn - full * libm::rint(turn.mid() / core::f64::consts::TAU);
        let way = [x[1] - pose.x[0], x[2] - pose.x[1]];
        let back = |way: [Interval; 2]| rotate(-Interval::point(pose.angle), way);
        let rest = match self.coordinates {
            Coordinates::State => way,
            Coordinates::Body => back(way),
            Coordinates::Left => left_jacobian_inverse(sigma, back(way)),
            Coordinates::Right => {
                let turned = rotate(sigma, pose.x.map(Interval::point));
                left_jacobian_inverse(sigma, [x[1] - turned[0], x[2] - turned[1]])
            }
        };
        [sigma, rest[0], rest[1]]
    }
}

/// M G for a 3 × 3 matrix.
pub(super) fn product(m: &Matrix3<f64>, g: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(3, g.cols());
    for (i, row) in m.iter().enumerate() {
        let [a, b, c] = *row;
        let target = out.row_mut(i);
        let columns = g.row(0).iter().zip(g.row(1)).zip(g.row(2));
        for (t, ((x, y), z)) in target.iter_mut().zip(columns) {
            *t = a * x + b * y + c * z;
        }
    }
    out
}

impl Belief for PoseZonotope {
    /// (θ̂, x̂).
    fn center(&self) -> Vec<f64> {
        vec![self.pose.angle, self.pose.x[0], self.pose.x[1]]
    }

    /// In the coordinates `Body` an enclosure of the set, rounded outward; else the box around the
    /// first-order set, X̂ ± |D G| 1, as the paper reports it: [`PoseZonotope::enclosure`] encloses.
    fn interval_hull(&self) -> Option<IntervalVector> {
        let center = self.center();
        if self.coordinates == Coordinates::Body {
            let sides = self.enclosure().ok()?;
            let with_center = |(side, &c): (&Interval, &f64)| side.hull(&Interval::point(c));
            return Some(sides.iter().zip(&center).map(with_center).collect());
        }
        let radius = self.state_generators().abs_row_sums();
        IntervalVector::from_center_radius(&center, &radius).ok()
    }

    /// Whether the set itself holds the pose, not its first-order picture.
    ///
    /// Where the headings reach π the pose has more than one error, of which only the least is looked at, and
    /// a box across half a turn holds headings whose least error is on the other side, 2π away: neither is
    /// ever called `Outside`.
    fn contains(&self, x: &[Interval]) -> Containment {
        let error = self.error_of(x);
        if error.iter().any(|side| !side.is_finite()) {
            return Containment::Undecided;
        }
        let verdict = self
            .error
            .contains(&error)
            .unwrap_or(Containment::Undecided);
        let headings = self.error.radius()[0] + self.error.c()[0].abs();
        // TAU is below 2π, and a sum that rounds below it is below it.
        let other_side = error[0].mag() + headings >= core::f64::consts::TAU;
        if verdict == Containment::Outside && (headings >= core::f64::consts::PI || other_side) {
            return Containment::Undecided;
        }
        verdict
    }

    fn covariance(&self) -> Option<&Matrix> {
        None
    }

    /// Of the errors' zonotope; `radius` is that of the interval hull in the state space.
    fn size(&self) -> Size {
        let radius = self.interval_hull().map(|hull| {
            let halves = hull.iter().map(|side| 0.5 * side.width());
            halves.fold(0.0, f64::max)
        });
        Size {
            n_generators: Some(self.error.generators()),
            trace_ggt: Some(self.error.trace_ggt()),
            radius,
            ..Size::default()
        }
    }

    /// The first-order set in the state space.
    fn shape(&self) -> Shape {
        let d = self.to_state();
        let mut center = self.center();
        for (c, row) in center.iter_mut().zip(d) {
            *c += row
                .iter()
                .zip(self.error.c())
                .map(|(d, e)| d * e)
                .sum::<f64>();
        }
        Shape {
            kind: "zonotope",
            center,
            generators: Some(self.state_generators()),
            ..Shape::default()
        }
    }

    fn says_the_same(&self, other: &Self) -> bool {
        self.coordinates == other.coordinates
            && self.pose == other.pose
            && self.error == other.error
    }

    /// `body_box_area`: the area of the box around the positions along the vehicle's axes, to first order;
    /// `projected_area`: their exact area.
    fn extras(&self) -> Vec<Extra> {
        let [along, across] = self.body_half_widths();
        vec![
            ("body_box_area", 4.0 * along * across),
            ("projected_area", self.projected_area()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_of_headings_across_half_a_turn_is_not_called_outside() {
        // σ ∈ [−3.12, −3.0]: the heading 3.17 is −3.113 turned once around.
        let center = vec![-3.06, 0.0, 0.0];
        let error = Zonotope::new(center, Matrix::diagonal(&[0.06, 1.0, 1.0])).unwrap();
        for coordinates in [Coordinates::Body, Coordinates::State] {
            let belief = PoseZonotope::new(Se2::identity(), error.clone(), coordinates);
            let at = |lo: f64, hi: f64| {
                let zero = Interval::ZERO;
                belief.contains(&[Interval::new(lo, hi).unwrap(), zero, zero])
            };
            assert_ne!(at(3.17, 3.17), Containment::Outside);
            assert_ne!(at(3.1, 3.18), Containment::Outside);
            assert_eq!(at(3.0, 3.05), Containment::Outside);
            assert_eq!(at(1.0, 1.0), Containment::Outside);
        }
    }
}
