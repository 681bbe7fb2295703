//! Scott's reduction of constrained zonotopes: rescaling, constraint elimination, lifted reduction.
//!
//! All three work on the *lifted* rows [G c; A −b]: row l of the upper part is a component of
//! x = c + G ξ, known up to r_l, row i of the lower part the residual A_i ξ − b_i, which lies within δ_i of
//! 0. Adding a multiple of a lower row to any row is the one operation of elimination, and r and δ are its
//! one slack vector.
//!
//! Source: J. K. Scott, D. M. Raimondo, G. R. Marseglia, R. D. Braatz, "Constrained zonotopes: a new tool
//! for set-based estimation and fault detection", Automatica 2016; [Rego2020, Sec. 5].

use super::yang_scott::{self, largest};
use crate::matrix::{abs_sum, dot};
use crate::rounding::{ETA, U, gamma, up};
use crate::{ConstrainedZonotope, Interval, Matrix, SetError, Zonotope, ops};

/// Sweeps over the constraints that a rescaling makes.
const SWEEPS: usize = 2;

/// A generator whose removal error is below this goes without comparing scores.
const FREE: f64 = 1e-3;

/// A row that has shrunk to this part of its first size is dependent on the others.
const DEPENDENT: f64 = 1e-12;

/// A coefficient this small beside the largest of its row does not count.
const NEGLIGIBLE: f64 = 1e-9;

/// Up to here reciprocals are normal numbers, hence rounded by less than u of themselves: 2¹⁰²².
const LARGEST: f64 = 1.0 / f64::MIN_POSITIVE;

/// A coordinate's range is left alone where it would shrink by less than this.
const SHRINK: f64 = 1e-13;

/// Encloses `x` in a set of at most `constraints` constraints, then of at most `generators` generators.
///
/// [`eliminate_constraints`], then [`reduce_generators`]. Contains `x`. Fails with `Empty` if `x` is proved
/// empty on the way, with `Range` if `generators` < n + the constraints left.
pub fn reduce(
    x: &ConstrainedZonotope,
    generators: usize,
    constraints: usize,
) -> Result<ConstrainedZonotope, SetError> {
    reduce_generators(&eliminate_constraints(x, constraints)?, generators)
}

/// Encloses `x` in a set of at most `generators` generators, its constraints kept in number.
///
/// The lifted zonotope ⟨(c, −b), [G; A], (r, δ)⟩ is reduced by [`yang_scott`]; its lower rows are the
/// new constraints, and the lower part of its rounding box is δ. This is a set identity apart from the
/// zonotope reduction. Contains `x`; `x` itself if it has no more generators.
///
/// Fails with `Range` if `generators` < n + q.
pub fn reduce_generators(
    x: &ConstrainedZonotope,
    generators: usize,
) -> Result<ConstrainedZonotope, SetError> {
    const OP: &str = "reduction of a constrained zonotope's generators";
    let (n, q) = (x.dim(), x.constraints());
    if generators < n + q {
        return Err(SetError::Range {
            op: OP,
            what: "number of generators",
            expected: "at least dimension + constraints",
            got: generators as f64,
        });
    }
    if x.generators() <= generators {
        return Ok(x.clone());
    }
    let minus: Vec<f64> = x.b().iter().map(|b| -b).collect();
    let lifted = Zonotope::with_rounding(
        [x.c(), &minus].concat(),
        Matrix::vcat(&[x.g(), x.a()]),
        [x.r(), x.delta()].concat(),
    )?;
    let reduced = yang_scott::reduce(&lifted, generators)?;
    let part = |rows: std::ops::Range<usize>| {
        Matrix::from_fn(rows.len(), reduced.generators(), |i, j| {
            reduced.g()[(rows.start + i, j)]
        })
    };
    let b = reduced.c()[n..].iter().map(|b| -b).collect();
    let z = Zonotope::checked(
        OP,
        reduced.c()[..n].to_vec(),
        part(0..n),
        reduced.r()[..n].to_vec(),
    )?;
    ConstrainedZonotope::checked(OP, z, part(n..n + q), b, reduced.r()[n..].to_vec())
}

/// The set `x` with each ξ_j replaced by m_j + ρ_j ζ_j, where [m_j ± ρ_j] bounds ξ_j over the constraints.
///
/// Two sweeps over the rows: row i confines ξ_j to R_j = (\[b_i ± δ_i\] − Σ_{k≠j} a_ik E_k)/a_ij, and E_j
/// becomes E_j ∩ R_j, everything rounded outward. Then
/// ⟨c + G m, G diag ρ, A diag ρ, b − A m⟩ with ρ rounded up and r, δ charged for the rounding of the rest.
/// Columns that become zero go. Contains `x`. Fails with `Empty` if some E_j is empty.
pub fn rescale(x: &ConstrainedZonotope) -> Result<ConstrainedZonotope, SetError> {
    let mut lifted = Lifted::new(x);
    lifted.rescale()?;
    lifted.drop_zero_columns();
    lifted.into_set()
}

/// The set `x` written around another center: ⟨c + G m, G diag ρ⟩ ∩ x with [m_j ± ρ_j] ∋ ξ_j.
///
/// The first set contains `x` for any m, because ρ reaches both ends of the [`coordinate_bounds`] from it,
/// rounded up; its rows and those of the intersection are [`rescale`]'s and
/// [`ConstrainedZonotope::intersect`]'s. 2p generators and 2q + n constraints. Equal to `x` up to r and δ.
///
/// Fails with `Dimension` if m has not p entries, with `Empty` if `x` is proved empty.
///
/// Source: [Rego2020, Prop. 2], whose linear program chooses m so that c + G m is a given point.
pub fn recentred(x: &ConstrainedZonotope, m: &[f64]) -> Result<ConstrainedZonotope, SetError> {
    if m.len() != x.generators() {
        return Err(SetError::Dimension {
            op: "recentring",
            expected: x.generators(),
            got: m.len(),
        });
    }
    let mut lifted = Lifted::new(x);
    let (e, _) = lifted.ranges()?;
    let changed: Vec<(usize, f64, f64)> = (e.iter().zip(m).enumerate())
        .map(|(j, ((lo, hi), &m))| (j, m, (hi - m).max(m - lo).max(0.0).next_up()))
        .collect();
    lifted.substitute(&changed);
    lifted.into_set()?.intersect(x)
}

/// Intervals that contain each ξ_j over { |ξ| ≤ 1, |A ξ − b| ≤ δ }, from two sweeps over the rows.
///
/// Fails with `Empty` if one is empty, which proves that the set is.
pub fn coordinate_bounds(x: &ConstrainedZonotope) -> Result<Vec<Interval>, SetError> {
    let lifted = Lifted::new(x);
    let (range, _) = lifted.ranges()?;
    Ok(range
        .iter()
        .map(|(lo, hi)| Interval::trusted(lo, hi))
        .collect())
}

/// Encloses `x` in a set of at most `constraints` constraints, eliminating one with one generator at a time.
///
/// Each time: (1) Gauss–Jordan elimination of the constraints, the pivot of a row being its largest entry
/// and the next row the one whose 1-norm is smallest beside its pivot; (2) [`rescale`], which also gives
/// the removal error r_j = how far R_j exceeds E_j, in units of ρ_j; (3) rows that vanished and columns
/// that became zero go; (4) the generator with the least r_j if that is below 10⁻³, else the one whose
/// removal moves the set least: the least ‖G d_j‖₂ for the d_j that minimises ‖G d‖² + ‖d‖² with A d = 0,
/// d_j = r_j; of equal scores the first; (5) ξ_j is expressed by the row in which its coefficient is largest
/// beside the row's pivot, and both go.
///
/// Contains `x`; `x` itself if it has no more constraints. Fails with `Empty` if `x` is proved empty.
///
/// Source: Scott et al. 2016, Sec. 4.2. The score's ‖G d_j‖₂ is what \[Rego2020\]'s numbers need; with
/// ‖(G d_j, d_j)‖₂ the sets are wider.
pub fn eliminate_constraints(
    x: &ConstrainedZonotope,
    constraints: usize,
) -> Result<ConstrainedZonotope, SetError> {
    if x.constraints() <= constraints {
        return Ok(x.clone());
    }
    let _stage = ops::stage(ops::Stage::Reduction);
    let _kernel = ops::kernel(ops::Kernel::Elimination);
    let mut lifted = Lifted::new(x);
    while lifted.constraints() > constraints {
        lifted.gauss_jordan()?;
        if lifted.constraints() <= constraints {
            break;
        }
        let errors = lifted.rescale()?;
        let errors = lifted.drop_zero_columns_with(errors);
        ops::elimination(lifted.constraints(), lifted.cols);
        match lifted.cheapest(&errors) {
            Some(j) => lifted.eliminate(j),
            // No constraint has a coefficient left: the rows say nothing that was not checked.
            None => lifted.truncate(constraints),
        }
    }
    lifted.into_set()
}

/// The lower and the upper ends of a range for every coordinate.
struct Ranges {
    lo: Vec<f64>,
    hi: Vec<f64>,
}

impl Ranges {
    fn all(p: usize, lo: f64, hi: f64) -> Self {
        Self {
            lo: vec![lo; p],
            hi: vec![hi; p],
        }
    }

    fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        self.lo.iter().copied().zip(self.hi.iter().copied())
    }
}

/// Σ of the least and of the greatest a_j ξ_j over the ranges, and Σ of the greatest |a_j ξ_j|.
fn reach(row: &[f64], e: &Ranges) -> (f64, f64, f64) {
    let p = row.len();
    let (lo, hi) = (&e.lo[..p], &e.hi[..p]);
    let whole = p - p % 4;
    let (mut low, mut high, mut size) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    let mut add = |k: usize, j: usize| {
        let (x, y) = ends(row[j], lo[j], hi[j]);
        low[k] += x;
        high[k] += y;
        size[k] += if y.abs() > x.abs() { y.abs() } else { x.abs() };
    };
    for j in (0..whole).step_by(4) {
        add(0, j);
        add(1, j + 1);
        add(2, j + 2);
        add(3, j + 3);
    }
    for j in whole..p {
        add(j - whole, j);
    }
    let sum = |s: [f64; 4]| (s[0] + s[1]) + (s[2] + s[3]);
    (sum(low), sum(high), sum(size))
}

/// R_j ∩= (\[`least`, `most`\] − Σ_{k≠j} a_k E_k)/a_j and E_j ∩= R_j, Σ_k a_k E_k = \[`low`, `high`\].
///
/// Quotients are products with a rounded reciprocal, within 2u + u² of the true ones; moving them by 6u of
/// themselves and η outward covers that and its own rounding. A NaN compares false and changes nothing.
fn confine(
    row: &[f64],
    least: f64,
    most: f64,
    [low, high]: [f64; 2],
    e: &mut Ranges,
    r: &mut Ranges,
) {
    let p = row.len();
    let (e_lo, e_hi) = (&mut e.lo[..p], &mut e.hi[..p]);
    let (r_lo, r_hi) = (&mut r.lo[..p], &mut r.hi[..p]);
    for j in 0..p {
        let a = row[j];
        let (x, y) = ends(a, e_lo[j], e_hi[j]);
        let (from, to) = (least - (high - y), most - (low - x));
        // For a < 0 the two change places; for a = 0 nothing is known, and a subnormal reciprocal is not.
        let (from, to) = if a >= 0.0 { (from, to) } else { (to, from) };
        let inverse = if a == 0.0 || a.abs() > LARGEST {
            f64::NAN
        } else {
            1.0 / a
        };
        let (from, to) = (from * inverse, to * inverse);
        let from = from - (6.0 * U * from.abs() + ETA);
        let to = to + (6.0 * U * to.abs() + ETA);
        let (lo, hi) = (r_lo[j], r_hi[j]);
        let (lo, hi) = (
            if from > lo { from } else { lo },
            if to < hi { to } else { hi },
        );
        r_lo[j] = lo;
        r_hi[j] = hi;
        e_lo[j] = if lo > e_lo[j] { lo } else { e_lo[j] };
        e_hi[j] = if hi < e_hi[j] { hi } else { e_hi[j] };
    }
}

/// The lifted rows, n of the set and then the constraints.
struct Lifted {
    n: usize,
    cols: usize,
    rows: Vec<Vec<f64>>,
    /// c, then −b.
    offset: Vec<f64>,
    /// r, then δ.
    slack: Vec<f64>,
    /// 1/|pivot| of each constraint after Gauss–Jordan elimination: the scale at which rows compare.
    scale: Vec<f64>,
}

impl Lifted {
    fn new(x: &ConstrainedZonotope) -> Self {
        let upper = (0..x.dim()).map(|i| x.g().row(i).to_vec());
        let lower = (0..x.constraints()).map(|i| x.a().row(i).to_vec());
        Self {
            n: x.dim(),
            cols: x.generators(),
            rows: upper.chain(lower).collect(),
            offset: x
                .c()
                .iter()
                .copied()
                .chain(x.b().iter().map(|b| -b))
                .collect(),
            slack: [x.r(), x.delta()].concat(),
            scale: vec![1.0; x.constraints()],
        }
    }

    fn constraints(&self) -> usize {
        self.rows.len() - self.n
    }

    fn into_set(self) -> Result<ConstrainedZonotope, SetError> {
        const OP: &str = "elimination of constraints";
        let n = self.n;
        let matrix = |rows: &[Vec<f64>]| Matrix::from_fn(rows.len(), self.cols, |i, j| rows[i][j]);
        let b = self.offset[n..].iter().map(|b| -b).collect();
        let z = Zonotope::checked(
            OP,
            self.offset[..n].to_vec(),
            matrix(&self.rows[..n]),
            self.slack[..n].to_vec(),
        )?;
        ConstrainedZonotope::checked(OP, z, matrix(&self.rows[n..]), b, self.slack[n..].to_vec())
    }

    /// row_l −= λ row_i with λ = fl(row_lj/row_ij), column j set to 0.
    ///
    /// slack_l' = ⌈slack_l + |λ| slack_i + |row_lj − fl(λ row_ij)| + u |λ row_ij|
    ///            + u (Σ_{k≠j} (|row'_k| + |fl(λ row_ik)|) + |offset'| + |fl(λ offset_i)|)⌉ + η:
    /// each entry is a product and a difference, both rounded once; the entry set to 0 is charged with its
    /// remainder. Any λ is right.
    fn combine(&mut self, l: usize, i: usize, j: usize) {
        let (target, source) = pair(&mut self.rows, l, i);
        let lambda = target[j] / source[j];
        if lambda == 0.0 {
            self.slack[l] = if target[j] == 0.0 {
                self.slack[l]
            } else {
                up(self.slack[l] + target[j].abs(), 1)
            };
            target[j] = 0.0;
            return;
        }
        let along = lambda * source[j];
        let remainder = (target[j] - along).abs() + U * along.abs();
        target[j] = along;
        let mut lanes = [0.0; 4];
        let (t4, s4) = (target.chunks_exact_mut(4), source.chunks_exact(4));
        let s_rest = s4.remainder();
        let mut rest = [0.0; 4];
        let mut t4 = t4;
        for (t, s) in t4.by_ref().zip(s4) {
            for k in 0..4 {
                let along = lambda * s[k];
                t[k] -= along;
                lanes[k] += t[k].abs() + along.abs();
            }
        }
        for ((t, s), sum) in t4.into_remainder().iter_mut().zip(s_rest).zip(&mut rest) {
            let along = lambda * s;
            *t -= along;
            *sum = t.abs() + along.abs();
        }
        target[j] = 0.0;
        let along = lambda * self.offset[i];
        self.offset[l] -= along;
        let sizes = lanes.iter().chain(&rest).sum::<f64>() + self.offset[l].abs() + along.abs();
        let bound =
            self.slack[l] + lambda.abs() * self.slack[i] + remainder * (1.0 + 4.0 * U) + U * sizes;
        self.slack[l] = up(bound, self.cols / 4 + 16);
        ops::count(self.cols + 2, 3 * self.cols);
    }

    /// Gauss–Jordan elimination of the constraints; dependent ones go.
    ///
    /// A row is measured again only when it has changed: after one elimination most pivots still stand alone
    /// in their column, and clearing it costs nothing.
    fn gauss_jordan(&mut self) -> Result<(), SetError> {
        let n = self.n;
        let measure = |row: &[f64], offset: f64| {
            ops::count(1, row.len());
            let (j, pivot) = largest(row);
            (j, pivot, (abs_sum(row) + offset.abs()) / pivot)
        };
        let measures = self.rows[n..].iter().zip(&self.offset[n..]);
        let mut measures: Vec<(usize, f64, f64)> =
            measures.map(|(row, &b)| measure(row, b)).collect();
        let floor: Vec<f64> = measures.iter().map(|m| DEPENDENT * m.1).collect();
        let mut done = vec![false; self.constraints()];
        for _ in 0..self.constraints() {
            let mut best: Option<(f64, usize)> = None;
            for (i, &(_, pivot, ratio)) in measures.iter().enumerate() {
                if !done[i] && pivot > floor[i] && best.is_none_or(|(b, _)| ratio < b) {
                    best = Some((ratio, i));
                }
            }
            let Some((_, i)) = best else { break };
            let j = measures[i].0;
            done[i] = true;
            self.scale[i] = 1.0 / self.rows[n + i][j].abs();
            for l in (0..self.constraints()).filter(|&l| l != i) {
                if self.rows[n + l][j] != 0.0 {
                    self.combine(n + l, n + i, j);
                    if !done[l] {
                        measures[l] = measure(&self.rows[n + l], self.offset[n + l]);
                    }
                }
            }
        }
        for i in (0..done.len()).rev().filter(|&i| !done[i]) {
            self.contradiction(n + i)?;
            self.remove_row(n + i);
        }
        Ok(())
    }

    /// `Empty` if |b_i| exceeds |A_i| 1 + δ_i, rounded up, so that no |ξ| ≤ 1 meets row i.
    fn contradiction(&self, i: usize) -> Result<(), SetError> {
        if self.offset[i].abs() > up(abs_sum(&self.rows[i]) + self.slack[i], self.cols / 8 + 6) {
            return Err(SetError::Empty {
                op: "elimination of constraints",
            });
        }
        Ok(())
    }

    fn remove_row(&mut self, i: usize) {
        self.rows.remove(i);
        self.offset.remove(i);
        self.slack.remove(i);
        self.scale.remove(i - self.n);
    }

    fn truncate(&mut self, constraints: usize) {
        while self.constraints() > constraints {
            self.remove_row(self.rows.len() - 1);
        }
    }

    /// E_j and R_j of every coordinate; `Empty` if some E_j is.
    fn ranges(&self) -> Result<(Ranges, Ranges), SetError> {
        let p = self.cols;
        let (mut e, mut r) = (
            Ranges::all(p, -1.0, 1.0),
            Ranges::all(p, f64::NEG_INFINITY, f64::INFINITY),
        );
        // Sums of at most p terms, each a product; then four more operations.
        let error = gamma(p + 8);
        for _ in 0..SWEEPS {
            for i in self.n..self.rows.len() {
                let row = &self.rows[i];
                let (low, high, size) = reach(row, &e);
                ops::count_of(|| {
                    let left = row.iter().filter(|&&a| a != 0.0).count();
                    (2 * p + 4 * left, 3 * (p - 1) + 6 * left)
                });
                let (b, delta) = (-self.offset[i], self.slack[i]);
                let margin = delta + error * (size + b.abs() + delta) + ETA;
                let margin = margin * (1.0 + 8.0 * U);
                // The margin covers the rounding of all sums.
                confine(row, b - margin, b + margin, [low, high], &mut e, &mut r);
                if e.iter().fold(false, |none, (lo, hi)| none | (lo > hi)) {
                    return Err(SetError::Empty {
                        op: "rescaling of a constrained zonotope",
                    });
                }
            }
        }
        let entries = p * SWEEPS * self.constraints();
        ops::count(8 * entries, 14 * entries);
        Ok((e, r))
    }

    /// ξ = m + ρ ζ; the removal errors, in units of ρ (+∞ where no constraint has the coordinate).
    ///
    /// ρ = next_up(max(fl(hi − m), fl(m − lo))) reaches both ends from the m chosen. The offset takes G m:
    /// off by γ_{p+1}(|offset| + |row| |m|); G ρ by u |G'| 1, which are errors of the set as |ζ| ≤ 1.
    fn rescale(&mut self) -> Result<Vec<f64>, SetError> {
        let (e, r) = self.ranges()?;
        let mut changed = Vec::new();
        let mut errors = vec![f64::INFINITY; self.cols];
        for (j, ((lo, hi), (from, to))) in e.iter().zip(r.iter()).enumerate() {
            let mut half = 1.0;
            if lo > -1.0 + SHRINK || hi < 1.0 - SHRINK {
                let middle = 0.5 * (lo + hi);
                half = if lo == hi {
                    0.0
                } else {
                    (hi - middle).max(middle - lo).next_up()
                };
                changed.push((j, middle, half));
            }
            let excess = (lo - from).max(to - hi).max(0.0);
            // A coordinate known exactly has a zero column afterwards and goes there.
            errors[j] = if half > 0.0 {
                excess / half
            } else {
                f64::INFINITY
            };
        }
        self.substitute(&changed);
        Ok(errors)
    }

    /// ξ_j = m_j + ρ_j ζ_j for the (j, m_j, ρ_j) given.
    fn substitute(&mut self, changed: &[(usize, f64, f64)]) {
        if changed.is_empty() {
            return;
        }
        let m = changed.len();
        for ((row, offset), slack) in self
            .rows
            .iter_mut()
            .zip(&mut self.offset)
            .zip(&mut self.slack)
        {
            let (mut moved, mut size, mut scaled) = (0.0, offset.abs(), 0.0);
            for &(j, middle, half) in changed {
                let along = row[j] * middle;
                moved += along;
                size += along.abs();
                row[j] *= half;
                scaled += row[j].abs();
            }
            *offset += moved;
            *slack = up(*slack + gamma(m + 1) * size + U * scaled, m + 5);
        }
        ops::count(2 * m * self.rows.len(), 3 * m * self.rows.len());
    }

    fn drop_zero_columns(&mut self) {
        self.drop_zero_columns_with(Vec::new());
    }

    /// Removes the columns in which every row is 0, and their entries of `errors`.
    fn drop_zero_columns_with(&mut self, errors: Vec<f64>) -> Vec<f64> {
        let mut greatest = vec![0.0_f64; self.cols];
        for row in &self.rows {
            for (most, x) in greatest.iter_mut().zip(row) {
                *most = if x.abs() > *most { x.abs() } else { *most };
            }
        }
        let kept: Vec<usize> = (0..self.cols).filter(|&j| greatest[j] != 0.0).collect();
        if kept.len() == self.cols {
            return errors;
        }
        for row in &mut self.rows {
            for (to, &from) in kept.iter().enumerate() {
                row[to] = row[from];
            }
            row.truncate(kept.len());
        }
        self.cols = kept.len();
        kept.iter()
            .filter_map(|&j| errors.get(j).copied())
            .collect()
    }

    /// The generator to eliminate; `None` if no constraint has a coefficient.
    ///
    /// With K = I + GᵀG and P = K⁻¹ − K⁻¹Aᵀ(A K⁻¹ Aᵀ)⁻¹A K⁻¹ the d_j is r_j P e_j / P_jj. K⁻¹ = I − VᵀV for
    /// V = L⁻¹G, LLᵀ = I + GGᵀ, and P = I − VᵀV − WᵀW for W = N⁻¹A K⁻¹, NNᵀ = A K⁻¹Aᵀ: only an n × n
    /// and a q × q matrix are factored, and G P = (LLᵀ)⁻¹G − (G Wᵀ) W.
    fn cheapest(&self, errors: &[f64]) -> Option<usize> {
        let first_least = |scores: &mut dyn Iterator<Item = (usize, f64)>| {
            scores.fold(None, |best: Option<(usize, f64)>, (j, s)| match best {
                Some((_, least)) if least <= s => best,
                _ => Some((j, s)),
            })
        };
        // A column that is mere rounding in every row (a folded slack) would take its row along.
        let mut counts = vec![false; self.cols];
        for row in &self.rows[self.n..] {
            let floor = NEGLIGIBLE * largest(row).1;
            for (counts, x) in counts.iter_mut().zip(row) {
                *counts |= x.abs() > floor;
            }
        }
        let candidates = |j: &usize| errors[*j].is_finite() && counts[*j];
        let candidates: Vec<usize> = (0..self.cols).filter(candidates).collect();
        let (j, least) = first_least(&mut candidates.iter().map(|&j| (j, errors[j])))?;
        if least < FREE || candidates.len() == 1 {
            return Some(j);
        }
        let Some(moves) = self.moves() else {
            return Some(j);
        };
        first_least(&mut candidates.iter().map(|&j| (j, errors[j] * moves[j]))).map(|(j, _)| j)
    }

    /// ‖G P e_j‖₂ / P_jj for every j; `None` if a factor breaks down.
    fn moves(&self) -> Option<Vec<f64>> {
        let (n, q, p) = (self.n, self.constraints(), self.cols);
        let g = &self.rows[..n];
        // The rows at a common scale: P does not depend on it.
        let a: Vec<Vec<f64>> = self.rows[n..]
            .iter()
            .map(|row| {
                let largest = largest(row).1;
                row.iter().map(|x| x / largest).collect()
            })
            .collect();
        let mut gram = Matrix::from_fn(n, n, |i, j| dot(&g[i], &g[j]));
        for i in 0..n {
            gram[(i, i)] += 1.0;
        }
        let l = cholesky(gram)?;
        let mut v = g.to_vec();
        solve_lower(&l, &mut v);
        let mut w: Vec<Vec<f64>> = a.clone();
        for row in &mut w {
            let along: Vec<f64> = v.iter().map(|v| dot(row, v)).collect();
            for (&s, v) in along.iter().zip(&v) {
                row.iter_mut().zip(v).for_each(|(w, v)| *w -= s * v);
            }
        }
        // Of the symmetric A K⁻¹ Aᵀ the factor reads the lower half.
        let middle = Matrix::from_fn(q, q, |i, j| if j <= i { dot(&w[i], &a[j]) } else { 0.0 });
        solve_lower(&cholesky(middle)?, &mut w);
        let mut diagonal = vec![1.0; p];
        for row in v.iter().chain(&w) {
            diagonal.iter_mut().zip(row).for_each(|(d, x)| *d -= x * x);
        }
        // G P, row by row: Σ_k L⁻ᵀ_ik v_k − Σ_k (g_i · w_k) w_k.
        let mut squares = vec![0.0; p];
        let mut gk = v;
        solve_lower_transposed(&l, &mut gk);
        for (row, g) in gk.iter_mut().zip(g) {
            for w in &w {
                let s = dot(g, w);
                row.iter_mut().zip(w).for_each(|(x, w)| *x -= s * w);
            }
            squares
                .iter_mut()
                .zip(row.iter())
                .for_each(|(s, x)| *s += x * x);
        }
        // Beside the factors and solutions: A scaled, two Gram matrices, W and G P by 2 n q rows each, squares.
        let (dots, rows) = (n * n + q * q, 4 * n * q);
        ops::count(
            p * (dots + rows + 2 * n + 2 * q + 2),
            p * (dots + rows + 2 * n + q) - dots - rows / 2,
        );
        let moves: Vec<f64> = squares
            .iter()
            .zip(&diagonal)
            .map(|(s, &d)| if d > 0.0 { s.sqrt() / d } else { f64::INFINITY })
            .collect();
        Some(moves)
    }

    /// Expresses ξ_j by the constraint in which it counts most, and drops both.
    ///
    /// Where that constraint's slack is as large as its coefficient, it says nothing about ξ_j that
    /// |ξ_j| ≤ 1 does not: then only the constraint goes.
    fn eliminate(&mut self, j: usize) {
        let n = self.n;
        let weights = self.rows[n..]
            .iter()
            .zip(&self.scale)
            .map(|(row, s)| row[j].abs() * s);
        let weights: Vec<f64> = weights.collect();
        let i = n + largest(&weights).0;
        if self.slack[i] < self.rows[i][j].abs() {
            for l in (0..self.rows.len()).filter(|&l| l != i) {
                if self.rows[l][j] != 0.0 {
                    self.combine(l, i, j);
                }
            }
            for row in &mut self.rows {
                row.remove(j);
            }
            self.cols -= 1;
        }
        self.remove_row(i);
    }
}

/// The least and greatest a ξ for ξ in [lo, hi].
#[inline]
fn ends(a: f64, lo: f64, hi: f64) -> (f64, f64) {
    let (x, y) = (a * lo, a * hi);
    if a >= 0.0 { (x, y) } else { (y, x) }
}

/// Two rows, the first to be changed.
fn pair(rows: &mut [Vec<f64>], l: usize, i: usize) -> (&mut [f64], &[f64]) {
    if l < i {
        let (head, tail) = rows.split_at_mut(i);
        (&mut head[l], &tail[0])
    } else {
        let (head, tail) = rows.split_at_mut(l);
        (&mut tail[0], &head[i])
    }
}

/// L with M = L Lᵀ; `None` if a pivot is not above rounding.
fn cholesky(mut m: Matrix) -> Option<Matrix> {
    let n = m.rows();
    ops::count(n * (n + 1) * (n + 2) / 6, n * (n * n - 1) / 6);
    for k in 0..n {
        let first = m[(k, k)];
        let pivot = first - (0..k).fold(0.0, |s, l| s + m[(k, l)] * m[(k, l)]);
        if pivot.is_nan() || pivot <= 1e-14 * first.abs() {
            return None;
        }
        let root = pivot.sqrt();
        m[(k, k)] = root;
        for i in k + 1..n {
            let rest = (0..k).fold(m[(i, k)], |s, l| s - m[(i, l)] * m[(k, l)]);
            m[(i, k)] = rest / root;
        }
    }
    Some(m)
}

/// The operations of a triangular system with the right sides `b`.
fn count_triangular(b: &[Vec<f64>]) {
    let (n, p) = (b.len(), b.first().map_or(0, Vec::len));
    ops::count(p * n * (n + 1) / 2 + n, p * n * n.saturating_sub(1) / 2);
}

/// B ← L⁻¹ B, by rows.
fn solve_lower(l: &Matrix, b: &mut [Vec<f64>]) {
    count_triangular(b);
    for i in 0..b.len() {
        let (done, rest) = b.split_at_mut(i);
        let row = &mut rest[0];
        for (k, other) in done.iter().enumerate() {
            let f = l[(i, k)];
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= f * y);
        }
        let inverse = 1.0 / l[(i, i)];
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

/// B ← L⁻ᵀ B, by rows.
fn solve_lower_transposed(l: &Matrix, b: &mut [Vec<f64>]) {
    count_triangular(b);
    for i in (0..b.len()).rev() {
        let (head, rest) = b.split_at_mut(i + 1);
        let row = &mut head[i];
        for (k, other) in rest.iter().enumerate() {
            let f = l[(i + 1 + k, i)];
            row.iter_mut().zip(other).for_each(|(x, y)| *x -= f * y);
        }
        let inverse = 1.0 / l[(i, i)];
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// K = I + GᵀG, the saddle-point system [K Aᵀ e; A 0 0; eᵀ 0 0] solved outright.
    fn direct(x: &ConstrainedZonotope, j: usize) -> f64 {
        let (p, q) = (x.generators(), x.constraints());
        let gram = x.g().transpose().mul(x.g());
        let size = p + q + 1;
        let system = Matrix::from_fn(size, size, |r, c| {
            let (low, high) = (r.min(c), r.max(c));
            if high < p {
                gram[(r, c)] + f64::from(u8::from(r == c))
            } else if high < p + q {
                if low < p { x.a()[(high - p, low)] } else { 0.0 }
            } else {
                f64::from(u8::from(low == j))
            }
        });
        let mut right = vec![0.0; size];
        right[size - 1] = 1.0;
        let solution = system.inverse().unwrap().mul_vec(&right);
        let moved = x.g().mul_vec(&solution[..p]);
        dot(&moved, &moved).sqrt()
    }

    #[test]
    fn the_score_is_that_of_the_constrained_minimum() {
        let mut state = 1_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for (n, q, p) in [(2, 1, 3), (2, 5, 20), (3, 4, 9)] {
            let g = Matrix::from_fn(n, p, |_, _| next());
            let a = Matrix::from_fn(q, p, |_, _| next());
            let x = ConstrainedZonotope::new(vec![0.0; n], g, a, vec![0.0; q]).unwrap();
            let moves = Lifted::new(&x).moves().unwrap();
            for (j, found) in moves.iter().enumerate() {
                let expected = direct(&x, j);
                assert!(
                    (found - expected).abs() < 1e-9 * (1.0 + expected),
                    "{found} {expected}"
                );
            }
        }
    }
}
