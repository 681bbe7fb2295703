//! Zonotope plus Gaussian: the belief of the mixed filters EZGKF, EZGKF-M and EZGKP, and the steps
//! they share.
//!
//! The error of the estimate c is ξ-part plus Gaussian part: x − c ∈ G [−1, 1]^p + g, g ~ N(0, P).
//! The gain of a singular S, and what [`EstimationError::Singular`] and [`EstimationError::Overflow`] are, is as in the
//! Kalman filter.
//!
//! Nothing here is guaranteed: covariances have no certain set, confidence boxes hold with a
//! probability, and rounding is plain.

use super::innovation::{Innovation, Range};
use super::linear_output::{LinearOutput, complement, congruence};
use super::scale::{Scale, Units};
use crate::error::{before, finite_vector};
use crate::estimator::{Belief, Containment, Measurement, Shape, Size, box_contains};
use crate::system::Embedding;
use crate::{EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::ellipsoid::chi_square_isf;
use zonobench_sets::ops::{self, Stage};
use zonobench_sets::reduction::{combastel, parallel};
use zonobench_sets::{Interval, IntervalVector, List, Matrix, SetError, ZonotopicGaussian};

/// Which R^zg enters the gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gain {
    /// R^zg = (1 − η) Gᵛ Gᵛᵀ + η R: the minimiser of [dePaula, Eq. (18)], as in [dePaula, Eq. (31)].
    #[default]
    Optimal,
    /// R^zg = (1 − η) Gᵛ + η R with Gᵛ not squared. Not optimal, and a sum of numbers of different units; it is here because the paper's Table III
    /// agrees with it and not with its own Eq. (31). Needs a square symmetric Gᵛ.
    Unsquared,
}

/// c + G [−1, 1]^p + N(0, P), with the χ² quantile of its confidence box.
#[derive(Clone, Debug, PartialEq)]
pub struct MixedBelief {
    /// c, G and P.
    pub state: ZonotopicGaussian,
    /// σ, the 1 − α quantile of χ² with n degrees of freedom.
    pub quantile: f64,
    /// y_k, which the predictor uses only in its next prediction; None in the filters.
    pub(super) pending: Option<List<Option<f64>>>,
}

impl MixedBelief {
    pub(super) fn new(c: impl Into<List<f64>>, g: Matrix, p: Matrix, quantile: f64) -> Self {
        Self {
            state: ZonotopicGaussian::trusted(c, g, p),
            quantile,
            pending: None,
        }
    }

    /// Itself, or `Overflow` at step `k`.
    pub(super) fn finite(self, k: usize, op: &'static str) -> Result<Self, EstimationError> {
        let state = &self.state;
        let finite = state.c().iter().all(|x| x.is_finite())
            && state.g().is_finite()
            && state.p().is_finite();
        if finite {
            Ok(self)
        } else {
            Err(EstimationError::Overflow { k, op })
        }
    }

    /// The confidence box c ± r, r_i = Σ_j |G_ij| + √(σ P_ii). [dePaula, Eqs. (14), (15)]
    ///
    /// Fails where a bound is not finite.
    pub fn confidence_box(&self) -> Result<IntervalVector, SetError> {
        self.state.confidence_box(self.quantile)
    }
}

impl Belief for MixedBelief {
    fn center(&self) -> Vec<f64> {
        self.state.c().to_vec()
    }
    /// The confidence box: it holds with a probability, not for certain.
    fn interval_hull(&self) -> Option<IntervalVector> {
        self.confidence_box().ok()
    }
    /// Containment in the confidence box.
    fn contains(&self, x: &[Interval]) -> Containment {
        self.interval_hull()
            .map_or(Containment::Undecided, |hull| box_contains(&hull, x))
    }
    fn covariance(&self) -> Option<&Matrix> {
        Some(self.state.p())
    }
    /// `radius` is that of the confidence box; a set of both kinds has no volume.
    fn size(&self) -> Size {
        let radius = self.state.confidence_radius(self.quantile);
        Size {
            n_generators: Some(self.state.generators()),
            trace_ggt: Some(self.state.trace_ggt()),
            radius: Some(radius.into_iter().fold(0.0, f64::max)),
            ..Size::default()
        }
    }
    fn shape(&self) -> Shape {
        Shape {
            kind: "zonotopic-gaussian",
            center: self.state.c().to_vec(),
            generators: Some(self.state.g().clone()),
            covariance: Some(self.state.p().clone()),
            bounds: self.interval_hull(),
            ..Shape::default()
        }
    }
}

/// The settings that the mixed filters share.
#[derive(Clone, Copy, Debug)]
pub(super) struct MixedSettings {
    pub phi: usize,
    pub eta: f64,
    pub alpha: f64,
    pub gain: Gain,
    pub overbars: bool,
    pub merge_parallel: bool,
    pub scale: Scale,
}

/// Directions that differ by less are those of parallel generators: room for the rounding that
/// products of parallel columns have met, and no more.
const PARALLEL: f64 = 1e-12;

/// What the mixed filters share: the problem in quasi-LPV form, the settings, the correction.
#[derive(Clone, Debug)]
pub(super) struct MixedModel<Y> {
    system: Y,
    settings: MixedSettings,
    /// B, n × p.
    b: Matrix,
    pub output: LinearOutput,
    /// R^zg, m × m. [dePaula, Eq. (31)]
    rzg: Matrix,
    /// Gʷ, n × n_gw.
    pub gw: Matrix,
    w_mean: Vec<f64>,
    /// Q, n × n.
    q: Matrix,
    pub prior: MixedBelief,
    units: Units,
}

impl<Y: System> MixedModel<Y> {
    /// Checks the settings and the problem: φ ≥ n, η in [0, 1], α in (0, 1), R^zg positive semidefinite.
    /// Covariances and shapes were checked with the problem; without a covariance it is zero, without
    /// generators there are none. w and v may have a mean.
    pub fn new(
        kind: &'static str,
        settings: MixedSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        problem.validate()?;
        let Some(form) = problem.system.quasi_lpv() else {
            return Err(EstimationError::Unsupported {
                kind,
                what: problem.system.kind(),
                reason: "it needs a system with a quasi-LPV form and a linear output".into(),
            });
        };
        let (b, c, d) = (
            form.input_matrix(),
            form.output_matrix(),
            form.feedthrough(),
        );
        let n = b.rows();
        let MixedSettings {
            phi, eta, alpha, ..
        } = settings;
        if phi < n {
            let expected = format!("at least n = {n}");
            return Err(EstimationError::setting(kind, "phi", expected, phi));
        }
        if !(0.0..=1.0).contains(&eta) {
            return Err(EstimationError::setting(kind, "eta", "in [0, 1]", eta));
        }
        if !(alpha > 0.0 && alpha < 1.0) {
            return Err(EstimationError::setting(kind, "alpha", "in (0, 1)", alpha));
        }
        for (key, part) in [
            ("prior.constraints", &problem.prior),
            ("noise.w.constraints", &problem.w),
            ("noise.v.constraints", &problem.v),
        ] {
            if part.constraints.is_some() {
                let expected = "left out: this filter has no constraints";
                return Err(EstimationError::setting(kind, key, expected, "constraints"));
            }
        }
        let output = LinearOutput::new(c, d, problem.v.mixed_mean().into(), &problem.v);
        let set_part = match settings.gain {
            Gain::Optimal => output.generators.gram(),
            Gain::Unsquared => {
                let gv = &output.generators;
                if gv.cols() != 0 && *gv != gv.transpose() {
                    let expected = "symmetric m x m generators of v for gain = \"unsquared\"";
                    return Err(EstimationError::setting(
                        kind,
                        "noise.v.generators",
                        expected,
                        format!("{gv:?}"),
                    ));
                }
                if gv.cols() == 0 {
                    Matrix::zeros(gv.rows(), gv.rows())
                } else {
                    gv.clone()
                }
            }
        };
        let mut rzg = set_part.scale(1.0 - eta);
        rzg.add_assign(&output.covariance.scale(eta));
        // With squared generators it is semidefinite by construction.
        if settings.gain == Gain::Unsquared
            && Range::of(&rzg, &List::filled(0.0, rzg.rows())).is_err()
        {
            let expected = "such that (1 - eta) Gv + eta R is positive semidefinite, \
                            so that the gain exists";
            return Err(EstimationError::setting(
                kind,
                "eta",
                expected,
                format!("{eta} with {rzg:?}"),
            ));
        }
        Ok(Self {
            system: problem.system.clone(),
            settings,
            b,
            output,
            rzg,
            gw: problem.w.generator_matrix(),
            w_mean: problem.w.mixed_mean(),
            q: problem.w.covariance_matrix(),
            units: settings.scale.units(&problem.prior),
            prior: MixedBelief::new(
                problem.prior.mixed_mean(),
                problem.prior.generator_matrix(),
                problem.prior.covariance_matrix().symmetrized(),
                chi_square_isf(alpha, n)
                    .map_err(|_| EstimationError::setting(kind, "alpha", "in (0, 1)", alpha))?,
            ),
        })
    }

    /// A₀ and A_i over the confidence box of `belief`, the belief at k − 1.
    pub fn embed(&self, k: usize, belief: &MixedBelief) -> Result<Embedding, EstimationError> {
        let over = belief
            .confidence_box()
            .map_err(EstimationError::at(k, "confidence box"))?;
        let form = self
            .system
            .quasi_lpv()
            .expect("checked when the filter was made");
        form.embed(before(k)?, &over)
    }

    /// A₀ c + B u + (mean of w).
    pub fn forecast_center(
        &self,
        a0: &Matrix,
        c: &[f64],
        u: &[f64],
    ) -> Result<List<f64>, EstimationError> {
        finite_vector("input u", u, self.b.cols())?;
        let mut next = a0.mul_vec(c);
        self.b.add_mul_vec(u, &mut next);
        for (x, w) in next.iter_mut().zip(&self.w_mean) {
            *x += w;
        }
        Ok(next)
    }

    /// The covariance forecast, see [`covariance_bound`].
    pub fn forecast_covariance(&self, f0: &Matrix, a: &[Matrix], p: &Matrix) -> Matrix {
        let units = self.units.as_slice();
        covariance_bound_in(units, f0, a, p, &self.q, self.settings.overbars)
    }

    /// The optimal gain K = P^zg Cᵀ S⁻¹ with P^zg = (1 − η) G Gᵀ + η P, S = C P^zg Cᵀ + R^zg. It
    /// minimises (1 − η) tr(G₊ G₊ᵀ) + η tr(P₊), and any other weighting of the components too, so that their units do
    /// not matter. [dePaula, Theorem 1, Eqs. (29)-(32)]
    ///
    /// Where S is singular, K = P^zg Cᵀ S⁻ with a generalized inverse is a minimiser, too, and comes with the range
    /// of S. `rows` are the rows of y that `output` holds.
    fn gain(
        &self,
        k: usize,
        output: &LinearOutput,
        rows: Option<&[usize]>,
        g: &Matrix,
        p: &Matrix,
    ) -> Result<(Matrix, Option<Range>), EstimationError> {
        let _stage = ops::stage(Stage::Gain);
        let eta = self.settings.eta;
        let mut pzg = p.scale(eta);
        if eta < 1.0 {
            pzg.add_assign(&g.gram().scale(1.0 - eta));
        }
        let pct = pzg.mul_transpose(&output.c);
        let mut s = output.c.mul(&pct);
        let part;
        let r = match rows {
            None => &self.rzg,
            Some(rows) => {
                part = Matrix::from_fn(rows.len(), rows.len(), |i, j| self.rzg[(rows[i], rows[j])]);
                &part
            }
        };
        s.add_assign(r);
        s.symmetrize();
        Innovation {
            c: &output.c,
            p: &pzg,
            pct: &pct,
            r,
            s: &s,
        }
        .gain()
        .map_err(EstimationError::at(k, "gain"))
    }

    /// Fails with `Singular` unless the innovation z − C c lies where x − c and v can bring it: in the range of
    /// C (G Gᵀ + P) Cᵀ + Gᵛ Gᵛᵀ + R, whatever η counts.
    fn check_innovation(
        &self,
        k: usize,
        output: &LinearOutput,
        state: &ZonotopicGaussian,
        u: &[f64],
        z: &[f64],
    ) -> Result<(), EstimationError> {
        let p = state.p().add(&state.g().gram());
        let r = output.covariance.add(&output.generators.gram());
        let pct = p.mul_transpose(&output.c);
        let mut s = output.c.mul(&pct);
        s.add_assign(&r);
        s.symmetrize();
        let total = Innovation {
            c: &output.c,
            p: &p,
            pct: &pct,
            r: &r,
            s: &s,
        };
        let range = total.range().map_err(EstimationError::at(k, "gain"))?;
        let mut innovation: List<f64> = z.into();
        output.c.sub_mul_vec(state.c(), &mut innovation);
        let prior = &self.prior.state;
        let allowed = prior.p().add(&prior.g().gram());
        range.check(
            k,
            "gain",
            &innovation,
            &output.sizes(state.c(), u, z, &allowed),
        )
    }

    /// Takes in a measurement: with T = I − K C,
    /// c₊ = T c + K (y − D u − e), G₊ = [T G, −K Gᵛ], P₊ = T P Tᵀ + K R Kᵀ. [dePaula, Eqs. (19), (27), (28)]
    ///
    /// With `merge_parallel` the parallel columns of G are merged first. Returns the gain and the
    /// output rows used beside the corrected belief; None where nothing was measured.
    pub fn correct(
        &self,
        k: usize,
        belief: &MixedBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<Option<Correction>, EstimationError> {
        let (output, z) = self.output.observe(u, y)?;
        if z.is_empty() {
            return Ok(None);
        }
        let rows: Option<List<usize>> =
            (z.len() < y.len()).then(|| (0..y.len()).filter(|&i| y[i].is_some()).collect());
        let merged;
        let g = if self.settings.merge_parallel {
            merged = parallel::merge_columns(belief.state.g(), PARALLEL);
            &merged
        } else {
            belief.state.g()
        };
        let p = belief.state.p();
        let (gain, singular) = self.gain(k, &output, rows.as_ref().map(|rows| &rows[..]), g, p)?;
        if singular.is_some() {
            self.check_innovation(k, &output, &belief.state, u, &z)?;
        }
        let t = complement(&gain, &output.c);
        let mut center = t.mul_vec(belief.state.c());
        gain.add_mul_vec(&z, &mut center);
        let kgv = gain.mul(&output.generators);
        let generators = Matrix::hcat(&[&t.mul(g), &kgv.scale(-1.0)]);
        let mut covariance = congruence(&t, p);
        let krk = congruence(&gain, &output.covariance);
        covariance.add_assign(&krk);
        Ok(Some(Correction {
            belief: MixedBelief::new(center, generators, covariance, belief.quantile)
                .finite(k, "update")?,
            gain,
            output: output.into_owned(),
            z,
        }))
    }

    /// At most φ generators, by [`combastel::reduce_columns`].
    pub fn reduce_order(&self, mut belief: MixedBelief) -> MixedBelief {
        if belief.state.generators() > self.settings.phi {
            let g = self.units.columns(belief.state.g(), |g| {
                combastel::reduce_columns(g, self.settings.phi)
            });
            belief.state = belief.state.with_generators(g);
        }
        belief
    }
}

/// A corrected belief with what made it.
pub(super) struct Correction {
    pub belief: MixedBelief,
    /// K.
    pub gain: Matrix,
    /// The rows of the output equation that were measured.
    pub output: LinearOutput,
    /// y − D u − e in these rows.
    pub z: List<f64>,
}

/// |M| = V |Λ| Vᵀ for the symmetric M = V Λ Vᵀ: the least upper bound of ±M that commutes with M.
/// [dePaula, Lemma 1]
///
/// It depends on the components' units: with U = diag(`units`), U |U⁻¹ M U⁻¹| U, which bounds ±M as well.
fn absolute(m: &Matrix, units: Option<&[f64]>) -> Matrix {
    if let Some(u) = units {
        let scaled = Matrix::from_fn(m.rows(), m.cols(), |i, j| m[(i, j)] / u[i] / u[j]);
        let bound = absolute(&scaled, None);
        return Matrix::from_fn(m.rows(), m.cols(), |i, j| bound[(i, j)] * u[i] * u[j]);
    }
    let (values, vectors) = m.symmetric_eigen();
    let magnitudes: List<f64> = values.iter().map(|x| x.abs()).collect();
    congruence(&vectors, &Matrix::diagonal(&magnitudes))
}

/// An upper bound on A(δ) P A(δ)ᵀ + Q for every |δ_i| ≤ 1, where A(δ) = F₀ + Σ δ_i A_i:
///
/// F₀ P F₀ᵀ + Q + Σ_i [ |F₀ P A_iᵀ + A_i P F₀ᵀ| + A_i P A_iᵀ ] + Σ_{i<j} |A_i P A_jᵀ + A_j P A_iᵀ|,
///
/// with |M| = V |Λ| Vᵀ, which depends on the components' units (the setting `scale`). All n × n; P and Q symmetric positive semidefinite. With `overbars` false the
/// bars are left out, which is the covariance at δ = (1, …, 1) alone and bounds nothing else.
///
/// Source: [dePaula, Eq. (26), Proposition 2, Lemma 1]; δ_i² ≤ 1 multiplies a positive semidefinite
/// matrix, so A_i P A_iᵀ needs no bar.
pub fn covariance_bound(
    f0: &Matrix,
    a: &[Matrix],
    p: &Matrix,
    q: &Matrix,
    overbars: bool,
) -> Matrix {
    covariance_bound_in(None, f0, a, p, q, overbars)
}

/// [`covariance_bound`] with |M| taken in `units`.
fn covariance_bound_in(
    units: Option<&[f64]>,
    f0: &Matrix,
    a: &[Matrix],
    p: &Matrix,
    q: &Matrix,
    overbars: bool,
) -> Matrix {
    let mut bound = congruence(f0, p);
    bound.add_assign(q);
    let mut add_cross = |left: &Matrix, right: &Matrix| {
        // M + Mᵀ = 2 · symmetric part.
        let mut cross = left.mul(p).mul_transpose(right);
        cross.symmetrize();
        let cross = if overbars {
            absolute(&cross, units)
        } else {
            cross
        };
        bound.add_assign(&cross.scale(2.0));
    };
    for (i, ai) in a.iter().enumerate() {
        add_cross(f0, ai);
        for aj in &a[i + 1..] {
            add_cross(ai, aj);
        }
    }
    for ai in a {
        bound.add_assign(&congruence(ai, p));
    }
    bound
}
