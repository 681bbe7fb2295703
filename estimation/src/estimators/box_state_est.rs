//! Box-State-Est: a guaranteed box observer for linear systems.
//!
//! The state n − 1 steps ago is recovered from the last n measurements by a left inverse of the
//! observability matrix, intersected with what was predicted for it then, brought forward to now, and
//! intersected with what was predicted for now. All of it in outward-rounded interval arithmetic.

use super::linear_output::check_measurement;
use super::scale::Scale;
use crate::error::finite_vector;
use crate::estimator::{
    Belief, Containment, Estimator, Measurement, Phase, Shape, Size, box_contains,
};
use crate::system::LinearParts;
use crate::{EstimationError, Problem, System, Uncertain};
use serde::{Deserialize, Serialize};
use zonobench_sets::interval_matrix::{dot, real_dot};
use zonobench_sets::units::nearest_power;
use zonobench_sets::{Interval, IntervalMatrix, IntervalVector, List, Matrix, SetError};

const KIND: &str = "box-state-est";

/// How (N_k 1)\[d\], (O_d 1)\[d\] and (M₂ 1)\[d\] are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Products {
    /// The box \[d\] is stacked first, one independent copy for each step, and multiplied once: guaranteed.
    #[default]
    Stacked,
    /// The matrix product is taken first, as printed. This holds only for a d that is constant over the
    /// window; with a d that varies it loses the state. Not guaranteed.
    Printed,
}

/// Settings of `box-state-est`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxStateEstSettings {
    /// How the products with the stacked noise are read.
    #[serde(default)]
    pub products: Products,
    /// In which units O* is the least-squares inverse: those of the measurements, as printed, or, with `prior`, the powers
    /// of two nearest to the half-widths of v (of the row of C where v is 0) and of the prior.
    #[serde(default, skip_serializing_if = "Scale::is_none")]
    pub scale: Scale,
}

/// The box \[x_k\] with the window that the next boxes are made from: at most the last n steps of
/// predictions, measurements, and the inputs that led into them.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxWindow {
    /// \[x_k\].
    bounds: IntervalVector,
    /// \[x_j\]_p … \[x_k\]_p, n entries each.
    predictions: Vec<Interval>,
    /// y_j … y_k, n_y entries each.
    measurements: Vec<Option<f64>>,
    /// u_{j−1} … u_{k−1}, n_u entries each (u_{−1} = 0).
    inputs: Vec<f64>,
}

impl BoxWindow {
    /// \[x_k\].
    pub fn bounds(&self) -> &IntervalVector {
        &self.bounds
    }
}

impl Belief for BoxWindow {
    /// The midpoint of the box.
    fn center(&self) -> Vec<f64> {
        self.bounds.mid().into_vec()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        Some(self.bounds.clone())
    }
    fn contains(&self, x: &[Interval]) -> Containment {
        box_contains(&self.bounds, x)
    }
    fn covariance(&self) -> Option<&Matrix> {
        None
    }
    fn size(&self) -> Size {
        let widths = self.bounds.widths();
        Size {
            radius: Some(self.bounds.rad().iter().copied().fold(0.0, f64::max)),
            volume: (widths.len() <= 3).then(|| widths.iter().product()),
            ..Size::default()
        }
    }
    fn shape(&self) -> Shape {
        Shape {
            kind: "box",
            center: self.center(),
            bounds: Some(self.bounds.clone()),
            ..Shape::default()
        }
    }
}

/// Box-State-Est for x⁺ = A x + B u + d, y = C x + D u + v with d ∈ \[d\], v ∈ \[v\], x_0 ∈ \[x_0\].
///
/// With j = k − n + 1, O = [C; C A; …; C Aⁿ⁻¹], M₁ = Aⁿ⁻¹, M₂ = [I, A, …, Aⁿ⁻²]:
///
/// * predict: \[x_k\]_p = A^k \[x_0\] + Σ_{i<k} A^{k−1−i} (B u_i + \[d\]) for k < n, then
///   \[x_k\]_p = A \[x_{k−1}\] + B u_{k−1} + \[d\];
/// * update, for k ≥ n − 1: R = (y_j; …; y_k) − (\[v\]; …; \[v\]) − O_d (\[d\]; …; \[d\]) − O_u (u_j; …; u_k),
///   \[x_j\]_c = (O* R) ∩ \[x_j\]_p, \[x_k\] = (M₁ \[x_j\]_c + M₂ (\[d\]; …; \[d\]) + inputs) ∩ \[x_k\]_p.
///   Before, \[x_k\] = \[x_k\]_p.
///
/// # Guarantee
///
/// With [`Products::Stacked`], x_k ∈ \[x_k\] for every k if the assumptions hold, for the f64 matrices
/// given and with every rounding counted. O, O_d, O_u, M₁, M₂ and A^k are interval matrices, made by
/// repeated interval products. O* is any f64 matrix Q close to a left inverse: from
/// R ∋ O x_j follows x_j = Q O x_j + (I − Q O) x_j ∈ Q R + (I − Q \[O\]) \[x_j\]_p, where the defect
/// I − Q \[O\] is evaluated in intervals, so that no property of Q is assumed.
/// An empty intersection is [`EstimationError::Inconsistent`]: the assumptions do not hold.
///
/// A measurement with missing components leaves the rows out that it lacks; where the rows that remain
/// have not rank n, the correction is left out and \[x_k\] = \[x_k\]_p.
///
/// # Units
///
/// Where O has more rows than columns, O* = (Oᵀ O)⁻¹ Oᵀ is a least-squares inverse, which compares measurements with each
/// other: boxes depend on their units, and on those of x by rounding. With [`Scale::Prior`] they do not.
///
/// Source: [MeslemRamdani, algorithm Box-State-Est]. Departures: the stacked reading, the defect, and ≤ for < in
/// its Eq. (4). The belief at k has read y_{k−n+1} … y_k, and through the intersections all before.
#[derive(Clone, Debug)]
pub struct BoxStateEst {
    products: Products,
    parts: LinearParts,
    d: IntervalVector,
    x0: IntervalVector,
    /// \[A^0\] … \[A^n\].
    powers: Vec<IntervalMatrix>,
    /// N_k (\[d\]; …; \[d\]) for k = 0 … n − 1; the last is M₂ (\[d\]; …; \[d\]).
    drifts: Vec<Vec<Interval>>,
    /// \[A^i B\] for i = 0 … n − 2.
    input_steps: Vec<IntervalMatrix>,
    o: IntervalMatrix,
    /// (\[v\]; …; \[v\]) + O_d (\[d\]; …; \[d\]).
    noise: Vec<Interval>,
    /// O_u, n·n_y × n·n_u.
    o_u: IntervalMatrix,
    inversion: Inversion,
    condition: f64,
    units: Option<Units>,
}

/// Powers of two that O is measured in before it is inverted.
#[derive(Clone, Debug)]
struct Units {
    /// Of the n components of x.
    x: List<f64>,
    /// Of the n_y components of y.
    y: List<f64>,
}

impl Units {
    fn of<Y>(
        scale: Scale,
        parts: &LinearParts,
        problem: &Problem<Y>,
        v: &IntervalVector,
    ) -> Option<Self> {
        let x = List::from(scale.units(&problem.prior).as_slice()?);
        let row = |i: usize| {
            let sizes = parts.c.row(i).iter().zip(&x).map(|(c, x)| (c * x).abs());
            sizes.fold(0.0, f64::max)
        };
        let rad = v.rad();
        let y = (0..v.dim()).map(|i| nearest_power(if rad[i] > 0.0 { rad[i] } else { row(i) }));
        Some(Self { y: y.collect(), x })
    }

    /// diag(y)⁻¹ O diag(x), of these rows of O.
    fn of_rows(&self, o: &Matrix, rows: &[usize]) -> Matrix {
        Matrix::from_fn(o.rows(), o.cols(), |i, j| {
            o[(i, j)] * self.x[j] / self.y[rows[i] % self.y.len()]
        })
    }

    /// diag(x) Q diag(y)⁻¹ of the inverse in these units.
    fn back(&self, q: &Matrix, rows: &[usize]) -> Matrix {
        Matrix::from_fn(q.rows(), q.cols(), |i, j| {
            q[(i, j)] * self.x[i] / self.y[rows[j] % self.y.len()]
        })
    }
}

/// An approximate left inverse and its defect.
#[derive(Clone, Debug)]
struct Inversion {
    /// Q, n × rows.
    q: Matrix,
    /// I − Q \[O\], n × n.
    defect: IntervalMatrix,
}

/// Above this condition number of O the estimator warns: about half of the digits of a measurement are
/// lost in the inversion, and boxes are wide for that reason.
pub const CONDITION_WARNING: f64 = 1e8;

impl BoxStateEst {
    /// Fails where the system is not linear, a part of the problem has a covariance and no set, a
    /// power of A overflows, or the pair (A, C) is not observable.
    pub fn new<Y: System>(
        settings: &BoxStateEstSettings,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        problem.validate()?;
        let Some(parts) = problem.system.linear_parts() else {
            return Err(EstimationError::Unsupported {
                kind: KIND,
                what: problem.system.kind(),
                reason: "it needs a system of kind linear".into(),
            });
        };
        let x0 = set_part("prior.box", &problem.prior)?;
        let d = set_part("noise.w.box", &problem.w)?;
        let v = set_part("noise.v.box", &problem.v)?;
        let (n, ny, nu) = (parts.a.rows(), parts.c.rows(), parts.b.cols());
        let powers = IntervalMatrix::from(&parts.a).powers(n);
        let c = IntervalMatrix::from(&parts.c);
        let outputs: Vec<IntervalMatrix> = powers[..n].iter().map(|p| c.mul(p)).collect();
        let o = IntervalMatrix::vcat(&outputs.iter().collect::<Vec<_>>())
            .finite("observability matrix")
            .map_err(EstimationError::at(0, "observability matrix"))?;
        let decomposed = EstimationError::at(0, "observability matrix");
        let rank = o.mid().rank().map_err(&decomposed)?;
        if rank < n {
            return Err(EstimationError::Unobservable {
                kind: KIND,
                rank,
                n,
            });
        }
        let units = Units::of(settings.scale, &parts, problem, &v);
        let all: Vec<usize> = (0..n * ny).collect();
        let measured = match &units {
            Some(units) => units.of_rows(&o.mid(), &all),
            None => o.mid(),
        };
        let singular_values = measured.singular_values().map_err(&decomposed)?;
        let condition = singular_values[0] / singular_values[n - 1];
        let b = IntervalMatrix::from(&parts.b);
        let input_steps: Vec<IntervalMatrix> = powers[..n.saturating_sub(1)]
            .iter()
            .map(|p| p.mul(&b))
            .collect();
        let o_u = toeplitz(n, ny, nu, |lag| match lag {
            0 => IntervalMatrix::from(&parts.d),
            lag => outputs[lag - 1].mul(&b),
        });
        let products = settings.products;
        let drifts = (0..n)
            .map(|k| sum_of_products(products, &powers[..k], &d, n))
            .collect();
        let mut noise = Vec::with_capacity(n * ny);
        for i in 0..n {
            let of_d = sum_of_products(products, &outputs[..i], &d, ny);
            noise.extend(v.iter().zip(of_d).map(|(&v, of_d)| v + of_d));
        }
        let inversion = Inversion::new(&o, &all, units.as_ref())
            .map_err(EstimationError::at(
                0,
                "left inverse of the observability matrix",
            ))?
            .ok_or(EstimationError::Unobservable {
                kind: KIND,
                rank,
                n,
            })?;
        Ok(Self {
            products,
            parts,
            d,
            x0,
            powers,
            drifts,
            input_steps,
            o,
            noise,
            o_u,
            inversion,
            condition,
            units,
        })
    }

    /// σ_max(O)/σ_min(O), in the units of `scale`: by how much the inversion can magnify a relative error of the
    /// measurements.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    fn n(&self) -> usize {
        self.parts.a.rows()
    }

    /// \[x_k\]_p for 0 < k < n, from \[x_0\] and the inputs u_0 … u_{k−1} alone.
    fn open_loop(&self, k: usize, inputs: &[f64]) -> Vec<Interval> {
        let nu = self.parts.b.cols();
        let mut x: Vec<Interval> = (0..self.n())
            .map(|i| times(self.powers[k].row(i), self.x0.as_slice()) + self.drifts[k][i])
            .collect();
        for (age, step) in self.input_steps[..k].iter().enumerate() {
            add_product(&mut x, step, &inputs[(k - 1 - age) * nu..(k - age) * nu]);
        }
        x
    }

    /// R, the right side for the window's measured rows, and these rows.
    fn right_side(&self, window: &BoxWindow, u: &[f64]) -> (Vec<Interval>, Vec<usize>) {
        let nu = u.len();
        let mut inputs = window.inputs[nu..].to_vec();
        inputs.extend_from_slice(u);
        let mut side = Vec::with_capacity(window.measurements.len());
        let mut rows = Vec::with_capacity(window.measurements.len());
        for (row, y) in window.measurements.iter().enumerate() {
            if let Some(y) = y {
                let mut r = Interval::point(*y) - self.noise[row];
                for (&o, &u) in self.o_u.row(row).iter().zip(&inputs) {
                    if o != Interval::ZERO {
                        r = r - o * u;
                    }
                }
                side.push(r);
                rows.push(row);
            }
        }
        (side, rows)
    }

    /// \[x_k\]_c, from the full window that `belief` holds, or None where it does not determine x_j.
    fn correct(
        &self,
        k: usize,
        belief: &BoxWindow,
        u: &[f64],
    ) -> Result<Option<Vec<Interval>>, EstimationError> {
        let (n, nu) = (self.n(), u.len());
        let (side, rows) = self.right_side(belief, u);
        let partial;
        let inversion = if rows.len() == belief.measurements.len() {
            &self.inversion
        } else {
            let made = Inversion::new(&self.o, &rows, self.units.as_ref());
            match made.map_err(EstimationError::at(k, "left inverse of the measured rows"))? {
                Some(made) => {
                    partial = made;
                    &partial
                }
                None => return Ok(None),
            }
        };
        let predicted = &belief.predictions[..n];
        let mut past = Vec::with_capacity(n);
        for (i, prediction) in predicted.iter().enumerate() {
            let x = times(inversion.defect.row(i), predicted);
            let x = real_dot(x, inversion.q.row(i), &side);
            past.push(
                x.intersect(prediction)
                    .ok_or(EstimationError::Inconsistent { k })?,
            );
        }
        let mut x: Vec<Interval> = (0..n)
            .map(|i| times(self.powers[n - 1].row(i), &past) + self.drifts[n - 1][i])
            .collect();
        if nu > 0 {
            // The inputs u_j … u_{k−1} led into the slots 1 … n − 1 of the window.
            for (age, step) in self.input_steps.iter().enumerate() {
                let slot = n - 1 - age;
                add_product(&mut x, step, &belief.inputs[slot * nu..(slot + 1) * nu]);
            }
        }
        Ok(Some(x))
    }
}

impl Estimator for BoxStateEst {
    type Belief = BoxWindow;

    fn prior(&self) -> BoxWindow {
        BoxWindow {
            bounds: self.x0.clone(),
            predictions: self.x0.as_slice().to_vec(),
            measurements: vec![None; self.parts.c.rows()],
            inputs: vec![0.0; self.parts.b.cols()],
        }
    }

    fn predict(
        &self,
        k: usize,
        belief: &BoxWindow,
        u_prev: &[f64],
    ) -> Result<BoxWindow, EstimationError> {
        let (n, ny, nu) = (self.n(), self.parts.c.rows(), self.parts.b.cols());
        finite_vector("input u", u_prev, nu)?;
        let steps = belief.predictions.len() / n;
        let dropped = (steps + 1).saturating_sub(n);
        let mut inputs = Vec::with_capacity(n * nu);
        inputs.extend_from_slice(&belief.inputs[dropped * nu..]);
        inputs.extend_from_slice(u_prev);
        let x = if k < n {
            self.open_loop(k, &inputs[nu..])
        } else {
            let a = &self.parts.a;
            let mut x: Vec<Interval> = (0..n)
                .map(|i| real_dot(Interval::ZERO, a.row(i), belief.bounds.as_slice()) + self.d[i])
                .collect();
            for (i, x) in x.iter_mut().enumerate() {
                for (&b, &u) in self.parts.b.row(i).iter().zip(u_prev) {
                    *x = *x + Interval::point(b) * u;
                }
            }
            x
        };
        let bounds = IntervalVector::new(x)
            .finite("predicted box")
            .map_err(EstimationError::at(k, "predict"))?;
        let mut predictions = Vec::with_capacity(n * n);
        predictions.extend_from_slice(&belief.predictions[dropped * n..]);
        predictions.extend_from_slice(bounds.as_slice());
        let mut measurements = Vec::with_capacity(n * ny);
        measurements.extend_from_slice(&belief.measurements[dropped * ny..]);
        measurements.resize(measurements.len() + ny, None);
        Ok(BoxWindow {
            bounds,
            predictions,
            measurements,
            inputs,
        })
    }

    fn update(
        &self,
        k: usize,
        belief: &BoxWindow,
        u: &[f64],
        y: Measurement,
    ) -> Result<BoxWindow, EstimationError> {
        let (n, ny) = (self.n(), self.parts.c.rows());
        finite_vector("input u", u, self.parts.b.cols())?;
        check_measurement(y, ny)?;
        let mut updated = belief.clone();
        let last = updated.measurements.len() - ny;
        updated.measurements[last..].copy_from_slice(y);
        if updated.predictions.len() == n * n
            && let Some(corrected) = self.correct(k, &updated, u)?
        {
            updated.bounds = IntervalVector::new(corrected)
                .intersect(&belief.bounds)
                .map_err(EstimationError::at(k, "update"))?;
        }
        Ok(updated)
    }

    /// True for the stacked products.
    fn guaranteed(&self) -> bool {
        self.products == Products::Stacked
    }
    fn reads(&self) -> &'static str {
        "y_{k-n+1}..y_k"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
    fn warning(&self) -> Option<String> {
        (self.condition > CONDITION_WARNING).then(|| {
            format!(
                "{KIND}: the observability matrix has the condition number {:.1e}; boxes may be very wide",
                self.condition
            )
        })
    }
}

impl Inversion {
    /// For the rows of O with these indices; None if their rank is below n.
    fn new(
        o: &IntervalMatrix,
        rows: &[usize],
        units: Option<&Units>,
    ) -> Result<Option<Self>, SetError> {
        let n = o.cols();
        if rows.len() < n {
            return Ok(None);
        }
        let o = IntervalMatrix::from_fn(rows.len(), n, |i, j| o[(rows[i], j)]);
        if o.mid().rank()? < n {
            return Ok(None);
        }
        let q = match units {
            None => o.mid().pseudo_inverse()?,
            Some(units) => {
                let inverse = units.of_rows(&o.mid(), rows).pseudo_inverse()?;
                units.back(&inverse, rows)
            }
        };
        let defect = IntervalMatrix::identity(n).sub(&o.left_mul(&q));
        Ok(Some(Self {
            q,
            defect: defect.finite("defect of the left inverse")?,
        }))
    }
}

/// The box around the set part of `part`, which must have one unless it is a known point.
fn set_part(key: &'static str, part: &Uncertain) -> Result<IntervalVector, EstimationError> {
    if part.has_gaussian() && !part.has_set() {
        let expected = "given (or generators)";
        return Err(EstimationError::setting(
            KIND,
            key,
            expected,
            "only a covariance",
        ));
    }
    part.box_hull()
        .finite("box")
        .map_err(EstimationError::at(0, "interval hull"))
}

/// Σ_i H_i \[d\] with an independent d for each i, or (Σ_i H_i)\[d\] with a common one; each H_i has `rows`
/// rows.
fn sum_of_products(
    products: Products,
    h: &[IntervalMatrix],
    d: &IntervalVector,
    rows: usize,
) -> Vec<Interval> {
    let Some((first, rest)) = h.split_first() else {
        return vec![Interval::ZERO; rows];
    };
    match products {
        Products::Stacked => {
            let mut sum = first.mul_vec(d).into_sides();
            for h in rest {
                for (sum, &term) in sum.iter_mut().zip(h.mul_vec(d).as_slice()) {
                    *sum = *sum + term;
                }
            }
            sum
        }
        Products::Printed => rest
            .iter()
            .fold(first.clone(), |sum, h| sum.add(h))
            .mul_vec(d)
            .into_sides(),
    }
}

/// The block lower triangular matrix of n × n blocks whose block (i, c) is `block(i − c)`.
fn toeplitz(
    n: usize,
    rows: usize,
    cols: usize,
    block: impl Fn(usize) -> IntervalMatrix,
) -> IntervalMatrix {
    let blocks: Vec<IntervalMatrix> = (0..n).map(block).collect();
    IntervalMatrix::from_fn(n * rows, n * cols, |i, j| {
        let (row, col) = (i / rows, j / cols);
        if col > row {
            Interval::ZERO
        } else {
            blocks[row - col][(i % rows, j % cols)]
        }
    })
}

/// Σ_j m_j x_j, where exact zeros add nothing.
#[inline]
fn times(row: &[Interval], x: &[Interval]) -> Interval {
    dot(Interval::ZERO, row, x)
}

/// x += M u.
#[inline]
fn add_product(x: &mut [Interval], m: &IntervalMatrix, u: &[f64]) {
    for (i, x) in x.iter_mut().enumerate() {
        for (&m, &u) in m.row(i).iter().zip(u) {
            *x = *x + m * u;
        }
    }
}
