//! What ZSMF and InZSMF share: settings, gains, reductions, and one step of the recursion.
//!
//! Both are predictors: the belief at k + 1 is made from the belief at k, u_k and y_k by
//!
//! H̄ = R_s(H), L from (A, C, H̄), H⁺ = \[(A − L C) H̄, D_w H_w, −L H_v\],
//!
//! and differ in the coordinates of the error, hence in A, C, D_w, and in how L z moves the estimate.
//!
//! Source: [Li, Algorithms 1 and 2].

use super::pose_zonotope::{Coordinates, PoseZonotope, product};
use super::scale::{Scale, Units};
use crate::error::finite_vector;
use crate::estimator::Measurement;
use crate::systems::VehicleSe2;
use crate::{EstimationError, Problem, System, Uncertain};
use serde::de::{self, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use zonobench_sets::reduction::girard;
use zonobench_sets::se2::{Matrix3, Se2};
use zonobench_sets::zonotope::Zonotope;
use zonobench_sets::{Matrix, SetError};

/// Poles of the error's dynamics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poles {
    /// p₁, of the error along the direction of travel.
    pub longitudinal: f64,
    /// p₂, p₃, of the error across it and of the heading.
    pub lateral: [f64; 2],
}

/// How the gain is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PoseGain {
    /// L minimises tr(H⁺ H⁺ᵀ), and any other weighting of the components too. [Li, Theorem 3.3]
    #[default]
    FRadius,
    /// A − L C has these eigenvalues. [Li, Theorem 3.2]
    ///
    /// They bound the error at a steady speed only: of two speeds in turn, the product of two such steps can have
    /// an eigenvalue outside the unit circle.
    Poles(Poles),
}

impl Serialize for PoseGain {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::FRadius => to.serialize_str("f-radius"),
            Self::Poles(poles) => poles.serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for PoseGain {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct GainVisitor;
        impl<'de> Visitor<'de> for GainVisitor {
            type Value = PoseGain;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("\"f-radius\" or { longitudinal = p1, lateral = [p2, p3] }")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<PoseGain, E> {
                match name {
                    "f-radius" => Ok(PoseGain::FRadius),
                    _ => Err(E::invalid_value(de::Unexpected::Str(name), &self)),
                }
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<PoseGain, A::Error> {
                Poles::deserialize(MapAccessDeserializer::new(map)).map(PoseGain::Poles)
            }
        }
        from.deserialize_any(GainVisitor)
    }
}

/// How H is brought to s columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoseReduction {
    /// Keeps the longest columns and boxes the rest. [Li, Remark 1] Its norm adds rad and m; in other units, or with
    /// another `scale`, other columns are the longest.
    #[default]
    Outer,
    /// Keeps the columns of greatest ‖g‖₁ − ‖g‖∞ in units of the set's half-widths and boxes the rest.
    /// Not in the paper: its norm mixes rad and m.
    Girard,
    /// As `Outer` with sums in place of sums of absolute values: **not an enclosure**. It is here because
    /// the paper's tables agree with it and not with its own Remark 1.
    PaperTables,
}

/// The A of the gain and of the generators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transition {
    /// A = Ad of exp(−δ u): the errors' motion without a remainder.
    #[default]
    Exact,
    /// A = I − δ ad_u, its first-order part. [Li, Eq. (20)]
    FirstOrder,
}

/// Readings of the first steps. Variants to compare with the paper's numbers, which do not follow from its
/// algorithms there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transient {
    /// As printed: L_k from H̄_k.
    #[default]
    Printed,
    /// L_k from H̄_{k−1}, and L_1 from H̄_0 once more.
    Lag,
    /// One correction by y_0 alone before the first step, with the gain A⁻¹ L.
    InitialUpdate,
}

/// What becomes of the terms that the linearisation drops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Remainder {
    /// Nothing, as in the paper: no guarantee.
    #[default]
    Dropped,
    /// They are enclosed and appended.
    Enclosed,
}

/// Which invariant error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// log(X̂⁻¹ X).
    #[default]
    Left,
    /// log(X X̂⁻¹).
    Right,
}

/// Settings of `zsmf` and `inzsmf`; `transition`, `remainder` and `side` differ from their defaults for `inzsmf` alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleFilterSettings {
    /// s, the number of columns that H is reduced to before a step; at least 4.
    pub generators: usize,
    /// How the gain is chosen.
    #[serde(default)]
    pub gain: PoseGain,
    /// How H is reduced.
    #[serde(default)]
    pub reduction: PoseReduction,
    /// The A of the invariant filter.
    #[serde(default)]
    pub transition: Transition,
    /// A reading of the first steps.
    #[serde(default)]
    pub transient: Transient,
    /// What becomes of the dropped terms.
    #[serde(default)]
    pub remainder: Remainder,
    /// Which invariant error.
    #[serde(default)]
    pub side: Side,
    /// In which units columns are compared when H is reduced; those of the state unless given.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
}

impl VehicleFilterSettings {
    /// So many columns, and else what is the default.
    pub fn new(generators: usize) -> Self {
        Self {
            generators,
            gain: PoseGain::default(),
            reduction: PoseReduction::default(),
            transition: Transition::default(),
            transient: Transient::default(),
            remainder: Remainder::default(),
            side: Side::default(),
            scale: Scale::default(),
        }
    }
}

/// The part of a filter that does not depend on the coordinates of the error.
#[derive(Clone, Debug)]
pub(super) struct VehicleFilter {
    pub kind: &'static str,
    pub settings: VehicleFilterSettings,
    pub system: VehicleSe2,
    pub prior: PoseZonotope,
    /// H_w, 3 × n_w.
    pub hw: Matrix,
    /// H_v, 2 × n_v.
    pub hv: Matrix,
    pub units: Units,
}

/// z and the linear model z = C ε + (noise generators) ζ of what was measured.
pub(super) struct Innovation {
    /// Which components of y were measured.
    pub rows: Vec<usize>,
    /// z, one entry a row.
    pub z: Vec<f64>,
    /// C, rows × 3.
    pub c: Matrix,
    /// The generators of the noise in z, rows × n_v.
    pub hv: Matrix,
}

/// What a linear step gives: L z, and H⁺.
pub(super) struct Advance {
    /// L z; zero where nothing was measured.
    pub correction: [f64; 3],
    /// H⁺.
    pub generators: Matrix,
}

impl VehicleFilter {
    /// Checks the settings and what the problem gives; `coordinates` are those of H_0.
    pub fn new<Y: System>(
        kind: &'static str,
        settings: VehicleFilterSettings,
        problem: &Problem<Y>,
        coordinates: Coordinates,
    ) -> Result<Self, EstimationError> {
        problem.validate()?;
        let Some(system) = problem.system.as_vehicle() else {
            return Err(EstimationError::Unsupported {
                kind,
                what: problem.system.kind(),
                reason: "it needs a system of kind vehicle-se2".into(),
            });
        };
        if settings.generators < 4 {
            return Err(EstimationError::setting(
                kind,
                "generators",
                "at least 4, one more than there are states",
                settings.generators,
            ));
        }
        if let PoseGain::Poles(poles) = settings.gain {
            check_poles(kind, poles)?;
        }
        let parts = [
            ("prior", &problem.prior),
            ("noise.w", &problem.w),
            ("noise.v", &problem.v),
        ];
        for (key, part) in parts {
            if !part.has_set() {
                let got = if part.has_gaussian() {
                    "only a covariance"
                } else {
                    "nothing"
                };
                return Err(EstimationError::setting(
                    kind,
                    key,
                    "a set: a box or generators",
                    got,
                ));
            }
            if part.constraints.is_some() {
                return Err(EstimationError::setting(
                    kind,
                    key,
                    "a zonotope",
                    "constraints",
                ));
            }
        }
        let centered =
            |key: &'static str, part: &Uncertain| match part.center.iter().find(|c| **c != 0.0) {
                Some(c) => Err(EstimationError::setting(kind, key, "centered at zero", c)),
                None => Ok(part.generator_matrix()),
            };
        let hw = centered("noise.w", &problem.w)?;
        let hv = centered("noise.v", &problem.v)?;
        let center = &problem.prior.center;
        let pose = Se2::new(center[0], [center[1], center[2]]);
        let error = Zonotope::new(vec![0.0; 3], problem.prior.generator_matrix())
            .map_err(EstimationError::at(0, "prior"))?;
        Ok(Self {
            kind,
            settings,
            system: system.clone(),
            prior: PoseZonotope::new(pose, error, coordinates),
            hw,
            hv,
            units: settings.scale.units(&problem.prior),
        })
    }

    /// R_s(H), for a filter that guarantees nothing.
    pub fn reduce_columns(&self, h: &Matrix) -> Matrix {
        let s = self.settings.generators;
        match self.settings.reduction {
            PoseReduction::Outer => self.units.columns(h, |h| reduce_as_printed(h, s)),
            PoseReduction::Girard => girard::reduce_columns_scaled(h, s),
            PoseReduction::PaperTables => self
                .units
                .columns(h, |h| reduce_without_absolute_values(h, s)),
        }
    }

    /// The same belief with R_s(H).
    pub fn reduce_order(
        &self,
        k: usize,
        belief: PoseZonotope,
    ) -> Result<PoseZonotope, EstimationError> {
        if belief.error.generators() <= self.settings.generators {
            return Ok(belief);
        }
        let h = self.reduce_columns(belief.error.g());
        self.errors(k, h)
            .map(|error| PoseZonotope { error, ..belief })
    }

    /// ⟨0, H⟩.
    pub fn errors(&self, k: usize, h: Matrix) -> Result<Zonotope, EstimationError> {
        Zonotope::new(vec![0.0; 3], h).map_err(EstimationError::at(k, "generators"))
    }

    /// Checks u and y of a step.
    pub fn check(&self, u: &[f64], y: Measurement) -> Result<(), EstimationError> {
        finite_vector("input u", u, 2)?;
        check_measurement(y)
    }

    /// L for (A, C, P, Q_v), 3 × rows; `speed` is ν.
    pub fn gain(
        &self,
        k: usize,
        a: &Matrix3<f64>,
        p: &Matrix3<f64>,
        innovation: &Innovation,
        speed: f64,
    ) -> Result<Matrix, EstimationError> {
        match self.settings.gain {
            PoseGain::FRadius => f_radius_gain(a, p, &innovation.c, &innovation.hv.gram())
                .map_err(EstimationError::at(k, "gain")),
            PoseGain::Poles(poles) => {
                if speed == 0.0 {
                    return Err(EstimationError::Refused {
                        k,
                        kind: self.kind,
                        reason: "the pole gain needs a speed other than 0: at nu = 0 the heading is not \
                                 observable from the position"
                            .into(),
                    });
                }
                Ok(pole_gain(a, poles))
            }
        }
    }

    /// One step of the recursion from the reduced belief, with A and D_w H_w; without an innovation the gain
    /// is 0. Also H̄ H̄ᵀ, for a gain that lags.
    pub fn advance(
        &self,
        k: usize,
        belief: &PoseZonotope,
        a: &Matrix3<f64>,
        noise: &Matrix,
        innovation: Option<&Innovation>,
        speed: f64,
    ) -> Result<(Advance, Matrix3<f64>), EstimationError> {
        let h = belief.error.g();
        let p = gram(h);
        let Some(innovation) = innovation else {
            let generators = Matrix::hcat(&[&product(a, h), noise]);
            return Ok((
                Advance {
                    correction: [0.0; 3],
                    generators,
                },
                p,
            ));
        };
        let used = match self.settings.transient {
            Transient::Lag => belief.earlier.as_ref().unwrap_or(&p),
            _ => &p,
        };
        let l = self.gain(k, a, used, innovation, speed)?;
        let closed = closed_loop(a, &l, &innovation.c);
        let correction = times(&l, &innovation.z);
        let generators = Matrix::hcat(&[
            &product(&closed, h),
            noise,
            &negative_product(&l, &innovation.hv),
        ]);
        Ok((
            Advance {
                correction,
                generators,
            },
            p,
        ))
    }

    /// The correction by y_0 alone: K = A⁻¹ L, K z, and \[(I − K C) H, −K H_v\].
    pub fn initial_update(
        &self,
        belief: &PoseZonotope,
        a: &Matrix3<f64>,
        innovation: &Innovation,
        speed: f64,
    ) -> Result<Advance, EstimationError> {
        let h = belief.error.g();
        let l = self.gain(0, a, &gram(h), innovation, speed)?;
        let k = Matrix::from_fn(3, 3, |i, j| a[i][j])
            .inverse()
            .map_err(EstimationError::at(0, "inverse of A"))?
            .mul(&l);
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let closed = closed_loop(&identity, &k, &innovation.c);
        Ok(Advance {
            correction: times(&k, &innovation.z),
            generators: Matrix::hcat(&[
                &product(&closed, h),
                &negative_product(&k, &innovation.hv),
            ]),
        })
    }

    /// Whether the components measured are enough for the gain; a pole gain needs both.
    pub fn usable(&self, rows: &[usize]) -> bool {
        match self.settings.gain {
            PoseGain::FRadius => !rows.is_empty(),
            PoseGain::Poles(_) => rows.len() == 2,
        }
    }

    /// y − x̂ in the components measured, with C = the rows of `position` (how the position moves with the
    /// error) and the noise in the world's axes; None where nothing usable was measured.
    pub fn world_innovation(
        &self,
        pose: &Se2,
        position: &Matrix3<f64>,
        y: Measurement,
    ) -> Option<Innovation> {
        let rows: Vec<usize> = (0..2).filter(|&i| y[i].is_some()).collect();
        if !self.usable(&rows) {
            return None;
        }
        let z = rows
            .iter()
            .filter_map(|&i| Some(y[i]? - pose.x[i]))
            .collect();
        let c = Matrix::from_fn(rows.len(), 3, |r, j| position[rows[r] + 1][j]);
        let hv = Matrix::from_fn(rows.len(), self.hv.cols(), |r, j| self.hv[(rows[r], j)]);
        Some(Innovation { rows, z, c, hv })
    }
}

/// Checks y: two components, each finite or missing.
pub(super) fn check_measurement(y: Measurement) -> Result<(), EstimationError> {
    if y.len() != 2 {
        return Err(EstimationError::Dimension {
            what: "measurement y",
            expected: 2,
            got: y.len(),
        });
    }
    match y.iter().flatten().find(|y| !y.is_finite()) {
        Some(&value) => Err(EstimationError::NotFinite {
            what: "measurement y",
            value,
        }),
        None => Ok(()),
    }
}

/// Fails unless the poles are inside the unit circle and one gain can place them.
fn check_poles(kind: &'static str, poles: Poles) -> Result<(), EstimationError> {
    let all = [poles.longitudinal, poles.lateral[0], poles.lateral[1]];
    if let Some(p) = all.iter().find(|p| p.is_nan() || p.abs() >= 1.0) {
        return Err(EstimationError::setting(
            kind,
            "gain",
            "poles of magnitude below 1",
            p,
        ));
    }
    if all[0] == all[1] && all[1] == all[2] {
        return Err(EstimationError::setting(
            kind,
            "gain",
            "poles of which at most two are equal, because there are two measurements",
            format!("{} three times", all[0]),
        ));
    }
    Ok(())
}

/// L = A P Cᵀ S⁻¹ with S = C P Cᵀ + Q_v, the minimiser of tr(H⁺ H⁺ᵀ). [Li, Eq. (12)]
///
/// A and P are 3 × 3, C is m × 3 and Q_v m × m with m = 1 or 2. Fails with `Singular` unless S is positive
/// definite beyond rounding.
pub fn f_radius_gain(
    a: &Matrix3<f64>,
    p: &Matrix3<f64>,
    c: &Matrix,
    qv: &Matrix,
) -> Result<Matrix, SetError> {
    let m = c.rows();
    let pct = Matrix::from_fn(3, m, |i, j| {
        (0..3).fold(0.0, |s, l| s + p[i][l] * c[(j, l)])
    });
    let mut s = [[0.0; 2]; 2];
    for (i, row) in s.iter_mut().enumerate().take(m) {
        for (j, entry) in row.iter_mut().enumerate().take(m) {
            *entry = (0..3).fold(qv[(i, j)], |sum, l| sum + c[(i, l)] * pct[(l, j)]);
        }
    }
    let apct = product(a, &pct);
    let singular = SetError::Singular {
        op: "innovation matrix S = C P C' + Q_v",
    };
    if m == 1 {
        if s[0][0].is_nan() || s[0][0] <= 0.0 {
            return Err(singular);
        }
        return Ok(Matrix::from_fn(3, 1, |i, _| apct[(i, 0)] / s[0][0]));
    }
    let determinant = s[0][0] * s[1][1] - s[0][1] * s[1][0];
    if !(s[0][0] > 0.0 && determinant > 1e-14 * s[0][0] * s[1][1]) {
        return Err(singular);
    }
    Ok(Matrix::from_fn(3, 2, |i, j| {
        let (x, y) = (apct[(i, 0)], apct[(i, 1)]);
        match j {
            0 => (x * s[1][1] - y * s[1][0]) / determinant,
            _ => (y * s[0][0] - x * s[0][1]) / determinant,
        }
    }))
}

/// L, 3 × 2, such that A − L C has the eigenvalues `poles`, for C = \[0, I\] and an A whose first row is
/// (1, 0, 0), as all of these filters have.
///
/// Let (α, β) = (a₂₁, a₃₁) = n q with |q| = 1, how the heading moves the position, and r ⟂ q. With
/// s = p₂ + p₃ − 1 and g = (p₂ p₃ − s)/n,
///
/// A − L C = [1, −g qᵀ; n q, p₁ r rᵀ + s q qᵀ],
///
/// which has p₁ along r, and on (heading, q) the trace 1 + s = p₂ + p₃ and the determinant s + g n = p₂ p₃.
/// For A = I − δ ad_u this is L = [0, g; 1 − p₁, δω; −δω, 1 − s] with g = (p₂ p₃ − s)/(δν): the gain that the
/// usual routines for pole placement find, in closed form. [Li, Theorem 3.2]
///
/// n > 0 is the caller's duty: at zero speed there is no such L.
pub fn pole_gain(a: &Matrix3<f64>, poles: Poles) -> Matrix {
    let (alpha, beta) = (a[1][0], a[2][0]);
    let n = libm::hypot(alpha, beta);
    let q = [alpha / n, beta / n];
    let r = [q[1], -q[0]];
    let [p2, p3] = poles.lateral;
    let s = p2 + p3 - 1.0;
    let g = (p2 * p3 - s) / n;
    Matrix::from_fn(3, 2, |i, j| match i {
        0 => g * q[j],
        i => {
            let i = i - 1;
            a[i + 1][j + 1] - (poles.longitudinal * r[i] * r[j] + s * q[i] * q[j])
        }
    })
}

/// R_s(H): sorts the columns by decreasing norm, equal ones as they stand, keeps the first `columns` − n and
/// appends the diagonal matrix of the rest's row sums of absolute values; `h` itself if it has no more columns.
///
/// Rounded to nearest. Where columns of equal norm meet the cut, the result depends on their order, and so
/// does the next one: [`zonobench_sets::reduction::combastel`] keeps the order of `h` and not the sorted one.
///
/// Source: [Li, Remark 1].
pub fn reduce_as_printed(h: &Matrix, columns: usize) -> Matrix {
    reduce_sorted(h, columns, f64::abs)
}

/// As [`reduce_as_printed`] with sums **without absolute values**.
///
/// The rest cancels, so that the result encloses nothing. The paper's tables follow from it.
pub fn reduce_without_absolute_values(h: &Matrix, columns: usize) -> Matrix {
    reduce_sorted(h, columns, |x| x)
}

fn reduce_sorted(h: &Matrix, columns: usize, term: impl Fn(f64) -> f64) -> Matrix {
    let (n, p) = (h.rows(), h.cols());
    if p <= columns {
        return h.clone();
    }
    let mut order: Vec<(f64, usize)> = (0..p)
        // The root, because it makes one number of squares that differ in the last bit alone: columns that
        // are equally long but for their direction then stay in order.
        .map(|j| {
            let square = (0..n).fold(0.0, |s, i| s + h[(i, j)] * h[(i, j)]);
            (square.sqrt(), j)
        })
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let kept = columns - n;
    let mut out = Matrix::zeros(n, columns);
    for i in 0..n {
        let row = h.row(i);
        let target = out.row_mut(i);
        for (t, &(_, j)) in target.iter_mut().zip(&order[..kept]) {
            *t = row[j];
        }
        target[kept + i] = order[kept..]
            .iter()
            .fold(0.0, |s, &(_, j)| s + term(row[j]));
    }
    out
}

/// H Hᵀ.
pub(super) fn gram(h: &Matrix) -> Matrix3<f64> {
    let p = h.gram();
    core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]))
}

/// A − L C.
fn closed_loop(a: &Matrix3<f64>, l: &Matrix, c: &Matrix) -> Matrix3<f64> {
    core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..c.rows()).fold(a[i][j], |s, m| s - l[(i, m)] * c[(m, j)]))
    })
}

/// L z.
pub(super) fn times(l: &Matrix, z: &[f64]) -> [f64; 3] {
    core::array::from_fn(|i| l.row(i).iter().zip(z).fold(0.0, |s, (l, z)| s + l * z))
}

/// −L G.
fn negative_product(l: &Matrix, g: &Matrix) -> Matrix {
    Matrix::from_fn(l.rows(), g.cols(), |i, j| {
        (0..g.rows()).fold(0.0, |s, m| s - l[(i, m)] * g[(m, j)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients of det(z I − M) = z³ − e₁ z² + e₂ z − e₃.
    fn characteristic(m: &Matrix3<f64>) -> [f64; 3] {
        let minor = |i: usize, j: usize| m[i][i] * m[j][j] - m[i][j] * m[j][i];
        let det = m[0][0] * minor(1, 2) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        [
            m[0][0] + m[1][1] + m[2][2],
            minor(0, 1) + minor(0, 2) + minor(1, 2),
            det,
        ]
    }

    const POLES: Poles = Poles {
        longitudinal: 0.98,
        lateral: [0.95, 0.98],
    };

    fn observe_position() -> Matrix {
        Matrix::from_fn(2, 3, |i, j| f64::from(j == i + 1))
    }

    #[test]
    fn the_pole_gain_is_the_printed_case_and_places_the_poles_of_any_motion() {
        let (dt, omega, nu) = (0.01, 0.4, 8.0);
        let first_order = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, dt * omega],
            [dt * nu, -dt * omega, 1.0],
        ];
        let l = pole_gain(&first_order, POLES);
        let expected = [[0.0, 0.0125], [0.02, 0.004], [-0.004, 0.07]];
        for i in 0..3 {
            for j in 0..2 {
                assert!((l[(i, j)] - expected[i][j]).abs() < 1e-15, "{l:?}");
            }
        }
        for (omega, nu) in [(0.4, 8.0), (0.0, 1.0), (-3.0, -2.0), (40.0, 0.01)] {
            let a = Se2::exp([-dt * omega, -dt * nu, 0.0]).adjoint();
            let closed = closed_loop(&a, &pole_gain(&a, POLES), &observe_position());
            let (p, [q, r]) = (POLES.longitudinal, POLES.lateral);
            let expected = [p + q + r, p * q + p * r + q * r, p * q * r];
            for (got, want) in characteristic(&closed).iter().zip(expected) {
                assert!((got - want).abs() < 1e-12, "{omega} {nu}: {got} {want}");
            }
        }
    }

    type Gain = [[f64; 2]; 3];

    /// Gains of `scipy.signal.place_poles(A.T, C.T, [0.98, 0.95, 0.98], method="KNV0")` of SciPy 1.17.1, transposed,
    /// for the motions (ω, ν): the method of Kautsky, Nichols and Van Dooren, which knows nothing of a vehicle;
    /// `method="YT"` gives the same to 1e-12. Of the gains that place these poles it takes that with the
    /// eigenvectors farthest from dependent.
    const PLACED: [((f64, f64), Gain); 4] = [
        (
            (0.4, 8.0),
            [
                [2.4999999999944022e-5, 0.012499983333328916],
                [0.01999220001040003, 0.0040999890666751455],
                [-0.0038999896000085767, 0.06999180001093341],
            ],
        ),
        ((0.0, 1.0), [[0.0, 0.1], [0.02, 0.0], [0.0, 0.07]]),
        (
            (-3.0, -2.0),
            [
                [0.0007500000000001799, -0.049996249943748954],
                [0.019561282905262933, -0.030745387707558],
                [0.029245612697433174, 0.06953878459271245],
            ],
        ),
        (
            (40.0, 0.01),
            [
                [1.9999999999989206, 9.866309751174038],
                [-0.05696553084718825, 0.399153800866367],
                [-0.3796828837509392, -0.010912481147041575],
            ],
        ),
    ];

    #[test]
    fn the_pole_gain_is_that_of_a_general_pole_placement() {
        for ((omega, nu), expected) in PLACED {
            let a = Se2::exp([-0.01 * omega, -0.01 * nu, 0.0]).adjoint();
            let l = pole_gain(&a, POLES);
            for (i, row) in expected.iter().enumerate() {
                for (j, want) in row.iter().enumerate() {
                    let off = (l[(i, j)] - want).abs();
                    assert!(off < 1e-11, "{omega} {nu}: L({i}, {j}) is off by {off}");
                }
            }
        }
    }

    #[test]
    fn the_f_radius_gain_is_a_minimum() {
        let a = Se2::exp([-0.1, -0.5, 0.2]).adjoint();
        let h = Matrix::from_fn(3, 7, |i, j| ((5 * i + 3 * j + i * j) % 7) as f64 - 3.0);
        let (c, hv) = (
            observe_position(),
            Matrix::from_rows(&[[1.0, 0.3], [0.0, 0.5]]).unwrap(),
        );
        let l = f_radius_gain(&a, &gram(&h), &c, &hv.gram()).unwrap();
        let cost = |l: &Matrix| {
            let stacked = Matrix::hcat(&[
                &product(&closed_loop(&a, l, &c), &h),
                &negative_product(l, &hv),
            ]);
            let g = stacked.gram();
            g[(0, 0)] + g[(1, 1)] + g[(2, 2)]
        };
        let least = cost(&l);
        for i in 0..3 {
            for j in 0..2 {
                for step in [1e-3, -1e-3] {
                    let mut other = l.clone();
                    other[(i, j)] += step;
                    assert!(cost(&other) > least);
                }
            }
        }
    }

    #[test]
    fn a_singular_innovation_is_an_error() {
        let zero = [[0.0; 3]; 3];
        let identity = Se2::<f64>::identity().adjoint();
        let rank_one = Matrix::from_rows(&[[1.0, 1.0], [1.0, 1.0]]).unwrap();
        let error = f_radius_gain(&identity, &zero, &observe_position(), &rank_one).unwrap_err();
        assert!(error.to_string().contains("S = C P C' + Q_v"), "{error}");
    }

    #[test]
    fn sums_without_absolute_values_cancel() {
        let h = Matrix::from_rows(&[
            [5.0, 0.0, 0.0, 1.0, -1.0, 0.5],
            [0.0, 6.0, 0.0, 1.0, 1.0, 0.0],
            [0.0, 0.0, 4.0, 0.0, 0.5, 0.0],
        ])
        .unwrap();
        let expected = Matrix::from_rows(&[
            [0.0, 5.0, 0.5, 0.0, 0.0],
            [6.0, 0.0, 0.0, 2.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 4.5],
        ])
        .unwrap();
        assert_eq!(reduce_without_absolute_values(&h, 5), expected);
        assert_eq!(reduce_without_absolute_values(&h, 6), h);
    }

    #[test]
    fn a_gain_is_a_name_or_poles() {
        let read = |json: &str| serde_json::from_str::<PoseGain>(json);
        assert_eq!(read(r#""f-radius""#).unwrap(), PoseGain::FRadius);
        let poles = read(r#"{"longitudinal": 0.98, "lateral": [0.95, 0.98]}"#).unwrap();
        assert_eq!(poles, PoseGain::Poles(POLES));
        assert_eq!(
            read(&serde_json::to_string(&poles).unwrap()).unwrap(),
            poles
        );
        let error = read(r#""fradius""#).unwrap_err().to_string();
        assert!(
            error.contains("expected \"f-radius\" or { longitudinal"),
            "{error}"
        );
        assert!(read(r#"{"longitudinal": 0.98}"#).is_err());
    }
}
