//! Scott's reduction of constrained zonotopes: rescaling, constraint elimination, lifted reduction.
//!
//! All three work on the *lifted* rows [G c; A −b]: row l of the upper part is a component of
//! x = c + G ξ, known up to r_l, row i of the lower part the residual A_i ξ − b_i, which lies within δ_i of
//! 0. Adding a multiple of a lower row to any row is the one operation of elimination, and r and δ are its
//! one slack vector.
//!
//! Source: J. K. Scott, D. M. Raimondo, G. R. Marseglia, R. D. Braatz, "Constrained zonotopes: a new tool
//! for set-based estimation and fault detection", Automatica 2016; [Rego2020, Sec. 5].

mod scores;

use super::yang_scott::{self, largest};
use crate::matrix::abs_sum;
use crate::rounding::{ETA, U, gamma, up};
use crate::{ConstrainedZonotope, Interval, List, Matrix, SetError, Zonotope, ops};
use scores::{Scores, keep};

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

/// A coordinate's range is left alone where an end would move by less than this.
const SHRINK: f64 = 1e-13;

/// Encloses `x` in a set of at most `constraints` constraints, then of at most `generators` generators.
///
/// [`eliminate_constraints`], then [`reduce_generators`]; both depend on the components' units, and the second on those of
/// the constraints' rows ([`ConstrainedZonotope::divided_by`] gives both others). Contains `x`. Fails with `Empty` if `x` is proved
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
    let minus: List<f64> = x.b().iter().map(|b| -b).collect();
    let lifted = Zonotope::with_rounding(
        List::concat(&[x.c(), &minus]),
        Matrix::vcat(&[x.g(), x.a()]),
        List::concat(&[x.r(), x.delta()]),
    )?;
    let reduced = yang_scott::reduce(&lifted, generators)?;
    let part = |rows: std::ops::Range<usize>| {
        Matrix::from_fn(rows.len(), reduced.generators(), |i, j| {
            reduced.g()[(rows.start + i, j)]
        })
    };
    let b: List<f64> = reduced.c()[n..].iter().map(|b| -b).collect();
    let z = Zonotope::checked(OP, &reduced.c()[..n], part(0..n), &reduced.r()[..n])?;
    ConstrainedZonotope::checked(OP, z, part(n..n + q), b, &reduced.r()[n..])
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
pub fn coordinate_bounds(x: &ConstrainedZonotope) -> Result<List<Interval>, SetError> {
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
/// The scores ‖G d_j‖₂ compare components and d with G d: they depend on the components' units. All else here does not,
/// nor on those of the constraints.
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
#[derive(Debug, PartialEq)]
struct Ranges {
    lo: List<f64>,
    hi: List<f64>,
}

impl Ranges {
    fn all(p: usize, lo: f64, hi: f64) -> Self {
        Self {
            lo: List::filled(lo, p),
            hi: List::filled(hi, p),
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

/// Σ |a_j|, added in the order of [`reach`], which gives −Σ, Σ and Σ of it over ranges that are all [−1, 1].
fn reach_of_units(row: &[f64]) -> f64 {
    let four = row.chunks_exact(4);
    let rest = four.remainder();
    let mut lanes = [0.0; 4];
    for row in four {
        for k in 0..4 {
            lanes[k] += row[k].abs();
        }
    }
    for (lane, x) in lanes.iter_mut().zip(rest) {
        *lane += x.abs();
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// The columns in which `row` is not 0, in order, into `support`.
fn support_of(row: &[f64], support: &mut List<usize>) {
    // Where zeros are is unpredictable: the index is always written and the end moves or not.
    support.clear();
    support.resize(row.len(), 0);
    let mut count = 0;
    for (j, &a) in row.iter().enumerate() {
        support[count] = j;
        count += usize::from(a != 0.0);
    }
    support.truncate(count);
}

/// Which ranges E_j the rows have narrowed so far, and when: visits of rows count from 1.
struct Narrowed {
    /// The last visit that narrowed E_j; 0 for none.
    at: List<usize>,
    columns: List<usize>,
}

impl Narrowed {
    fn none(p: usize) -> Self {
        Self {
            at: List::filled(0, p),
            columns: List::new(),
        }
    }

    /// Whether some E_j with a_j ≠ 0 was narrowed by the visit `since` or a later one.
    fn concerns(&self, row: &[f64], since: usize) -> bool {
        (self.columns.iter()).any(|&j| self.at[j] >= since && row[j] != 0.0)
    }

    fn mark(&mut self, j: usize, visit: usize) {
        if self.at[j] == 0 {
            self.columns.push(j);
        }
        self.at[j] = visit;
    }
}

/// R_j ∩= (\[`least`, `most`\] − Σ_{k≠j} a_k E_k)/a_j and E_j ∩= R_j over the `support`, the columns where a_j ≠ 0;
/// Σ_k a_k E_k = \[`low`, `high`\]. True if some E_j is empty.
///
/// Quotients are products with a rounded reciprocal, within 2u + u² of the true ones; moving them by 6u of
/// themselves and η outward covers that and its own rounding. A NaN compares false and changes nothing.
#[allow(
    clippy::too_many_arguments,
    reason = "a row, its bounds, and what it acts on"
)]
fn confine(
    row: &[f64],
    support: &[usize],
    [least, most]: [f64; 2],
    [low, high]: [f64; 2],
    e: &mut Ranges,
    r: &mut Ranges,
    narrowed: &mut Narrowed,
    visit: usize,
) -> bool {
    let p = row.len();
    let (e_lo, e_hi) = (&mut e.lo[..p], &mut e.hi[..p]);
    let (r_lo, r_hi) = (&mut r.lo[..p], &mut r.hi[..p]);
    let mut empty = false;
    for &j in support {
        let a = row[j];
        let (x, y) = ends(a, e_lo[j], e_hi[j]);
        let (from, to) = (least - (high - y), most - (low - x));
        // For a < 0 the two change places; a subnormal reciprocal is not known well enough.
        let (from, to) = if a >= 0.0 { (from, to) } else { (to, from) };
        let inverse = if a.abs() > LARGEST { f64::NAN } else { 1.0 / a };
        let (from, to) = (from * inverse, to * inverse);
        let from = from - (6.0 * U * from.abs() + ETA);
        let to = to + (6.0 * U * to.abs() + ETA);
        let lo = if from > r_lo[j] { from } else { r_lo[j] };
        let hi = if to < r_hi[j] { to } else { r_hi[j] };
        r_lo[j] = lo;
        r_hi[j] = hi;
        if (lo > e_lo[j]) | (hi < e_hi[j]) {
            narrowed.mark(j, visit);
            e_lo[j] = if lo > e_lo[j] { lo } else { e_lo[j] };
            e_hi[j] = if hi < e_hi[j] { hi } else { e_hi[j] };
            empty |= e_lo[j] > e_hi[j];
        }
    }
    empty
}

/// The lifted rows, n of the set and then the constraints.
struct Lifted {
    n: usize,
    cols: usize,
    rows: List<List<f64>>,
    /// c, then −b.
    offset: List<f64>,
    /// r, then δ.
    slack: List<f64>,
    /// 1/|pivot| of each constraint after Gauss–Jordan elimination: the scale at which rows compare.
    scale: List<f64>,
    /// Of the present columns, once they were asked for.
    scores: Option<Scores>,
}

impl Lifted {
    fn new(x: &ConstrainedZonotope) -> Self {
        let upper = (0..x.dim()).map(|i| List::from(x.g().row(i)));
        let lower = (0..x.constraints()).map(|i| List::from(x.a().row(i)));
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
            slack: List::concat(&[x.r(), x.delta()]),
            scale: List::filled(1.0, x.constraints()),
            scores: None,
        }
    }

    fn constraints(&self) -> usize {
        self.rows.len() - self.n
    }

    fn into_set(self) -> Result<ConstrainedZonotope, SetError> {
        const OP: &str = "elimination of constraints";
        let n = self.n;
        let matrix = |rows: &[List<f64>]| Matrix::from_fn(rows.len(), self.cols, |i, j| rows[i][j]);
        let b: List<f64> = self.offset[n..].iter().map(|b| -b).collect();
        let z = Zonotope::checked(
            OP,
            &self.offset[..n],
            matrix(&self.rows[..n]),
            &self.slack[..n],
        )?;
        ConstrainedZonotope::checked(OP, z, matrix(&self.rows[n..]), b, &self.slack[n..])
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
        let mut measures: List<(usize, f64, f64)> =
            measures.map(|(row, &b)| measure(row, b)).collect();
        let floor: List<f64> = measures.iter().map(|m| DEPENDENT * m.1).collect();
        let mut done = List::filled(false, self.constraints());
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
    ///
    /// Rows are mostly 0 and few ranges are narrowed. Over ranges that are all [−1, 1] a row's sums are its
    /// 1-norm; and a row all of whose ranges are as they were before its last visit would say the same again.
    fn ranges(&self) -> Result<(Ranges, Ranges), SetError> {
        let (p, q) = (self.cols, self.constraints());
        let (mut e, mut r) = (
            Ranges::all(p, -1.0, 1.0),
            Ranges::all(p, f64::NEG_INFINITY, f64::INFINITY),
        );
        // Sums of at most p terms, each a product; then four more operations.
        let error = gamma(p + 8);
        let mut support = List::with_capacity(p);
        let mut narrowed = Narrowed::none(p);
        for visit in 1..=SWEEPS * q {
            let i = self.n + (visit - 1) % q;
            let row = &self.rows[i];
            if visit > q && !narrowed.concerns(row, visit - q) {
                continue;
            }
            support_of(row, &mut support);
            let (low, high, size) = if narrowed.concerns(row, 1) {
                ops::count(2 * p, 3 * p);
                reach(row, &e)
            } else {
                ops::count(0, p);
                let sum = reach_of_units(row);
                (-sum, sum, sum)
            };
            ops::count(6 * support.len(), 8 * support.len());
            let (b, delta) = (-self.offset[i], self.slack[i]);
            let margin = delta + error * (size + b.abs() + delta) + ETA;
            let margin = margin * (1.0 + 8.0 * U);
            // The margin covers the rounding of all sums.
            let (inner, outer) = ([b - margin, b + margin], [low, high]);
            if confine(
                row,
                &support,
                inner,
                outer,
                &mut e,
                &mut r,
                &mut narrowed,
                visit,
            ) {
                return Err(SetError::Empty {
                    op: "rescaling of a constrained zonotope",
                });
            }
        }
        Ok((e, r))
    }

    /// ξ = m + ρ ζ; the removal errors, in units of ρ (+∞ where no constraint has the coordinate).
    ///
    /// ρ = next_up(max(fl(hi − m), fl(m − lo))) reaches both ends from the m chosen. The offset takes G m:
    /// off by γ_{p+1}(|offset| + |row| |m|); G ρ by u |G'| 1, which are errors of the set as |ζ| ≤ 1.
    fn rescale(&mut self) -> Result<List<f64>, SetError> {
        let (e, r) = self.ranges()?;
        let mut changed = List::new();
        let mut errors = List::filled(f64::INFINITY, self.cols);
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
        if let Some(scores) = &mut self.scores {
            for &(j, _, half) in &changed {
                scores.rescale(j, half);
            }
        }
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
        self.drop_zero_columns_with(List::new());
    }

    /// Removes the columns in which every row is 0, and their entries of `errors`.
    fn drop_zero_columns_with(&mut self, mut errors: List<f64>) -> List<f64> {
        let mut zero: List<usize> = (0..self.cols).collect();
        for row in &self.rows {
            zero.retain(|&j| row[j] == 0.0);
        }
        if zero.is_empty() {
            return errors;
        }
        let mut kept = List::with_capacity(self.cols - zero.len());
        let mut zero = zero.iter().copied().peekable();
        kept.extend((0..self.cols).filter(|&j| zero.next_if_eq(&j).is_none()));
        for row in &mut self.rows {
            keep(row, &kept);
        }
        if let Some(scores) = &mut self.scores {
            scores.keep(&kept);
        }
        self.cols = kept.len();
        if !errors.is_empty() {
            keep(&mut errors, &kept);
        }
        errors
    }

    /// The generator to eliminate; `None` if no constraint has a coefficient.
    ///
    /// The [`Scores`] are made when they are first asked for, and again when they have been changed often.
    fn cheapest(&mut self, errors: &[f64]) -> Option<usize> {
        let mut candidates = List::with_capacity(self.cols);
        candidates.extend((0..self.cols).filter(|&j| errors[j].is_finite()));
        let (j, least) = self.first_least(&mut candidates, |j| errors[j])?;
        if least < FREE || candidates.len() == 1 {
            return Some(j);
        }
        if !self.scores.as_ref().is_some_and(Scores::fresh) {
            let (g, a) = self.rows.split_at(self.n);
            self.scores = Scores::of(g, a);
        }
        let Some(scores) = &self.scores else {
            return Some(j);
        };
        let moves = scores.moves();
        let best = self.first_least(&mut candidates, |j| errors[j] * moves[j]);
        best.map(|(j, _)| j)
    }

    /// The candidate of the least score, of equal ones the first, and its score; `None` if there is none that
    /// counts. Those found not to count are struck off.
    ///
    /// A column that is mere rounding in every row (a folded slack) would take its row along.
    fn first_least(
        &self,
        candidates: &mut List<usize>,
        score: impl Fn(usize) -> f64,
    ) -> Option<(usize, f64)> {
        let counts = |j: usize| {
            self.rows[self.n..]
                .iter()
                .any(|row| row[j] != 0.0 && row[j].abs() > NEGLIGIBLE * largest(row).1)
        };
        loop {
            let mut scores = candidates.iter().map(|&j| (j, score(j)));
            let first = scores.next()?;
            let best = scores.fold(first, |best, (j, s)| match best.1 <= s {
                true => best,
                false => (j, s),
            });
            if counts(best.0) {
                return Some(best);
            }
            candidates.retain(|&j| j != best.0);
        }
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
        let weights: List<f64> = weights.collect();
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
            if let Some(scores) = &mut self.scores {
                scores.eliminate(j);
            }
        } else {
            // What the constraint said is lost, and A is no longer what the scores are of.
            self.scores = None;
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
fn pair(rows: &mut [List<f64>], l: usize, i: usize) -> (&mut [f64], &[f64]) {
    if l < i {
        let (head, tail) = rows.split_at_mut(i);
        (&mut head[l], &tail[0])
    } else {
        let (head, tail) = rows.split_at_mut(l);
        (&mut tail[0], &head[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A set of `q` sparse constraints and `p` generators; the constraints hold at a point inside the box.
    fn set(n: usize, q: usize, p: usize, seed: u64) -> ConstrainedZonotope {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let g = Matrix::from_fn(n, p, |_, _| next());
        let a = Matrix::from_fn(q, p, |_, _| if next() > 0.2 { next() } else { 0.0 });
        // Near a corner of the box, so that the constraints narrow ranges.
        let inside: Vec<f64> = (0..p).map(|_| next().signum() * 0.9).collect();
        let b = a.mul_vec(&inside);
        ConstrainedZonotope::new(vec![0.0; n], g, a, b).unwrap()
    }

    #[test]
    fn updated_scores_are_those_of_the_rows_that_are_left() {
        for (n, q, p, seed) in [(2, 13, 30, 1), (4, 21, 50, 2), (3, 40, 90, 3)] {
            let mut lifted = Lifted::new(&set(n, q, p, seed));
            let mut updated = 0;
            while lifted.constraints() > 1 {
                lifted.gauss_jordan().unwrap();
                let errors = lifted.rescale().unwrap();
                let errors = lifted.drop_zero_columns_with(errors);
                let j = lifted.cheapest(&errors).unwrap();
                if let Some(scores) = lifted.scores.as_ref().filter(|s| s.fresh()) {
                    let (g, a) = lifted.rows.split_at(n);
                    let expected = Scores::of(g, a).unwrap().moves();
                    for (k, (found, expected)) in scores.moves().iter().zip(expected).enumerate() {
                        assert!(
                            (found - expected).abs() <= 1e-7 * (1.0 + expected),
                            "{} of {q} left, {k}: {found} {expected}",
                            lifted.constraints()
                        );
                    }
                    updated += usize::from(!scores.is_new());
                }
                lifted.eliminate(j);
            }
            assert!(updated >= q / 2, "{updated} comparisons of updated scores");
        }
    }

    /// Two whole sweeps over all columns, as `ranges` would be without leaving anything out.
    fn swept(lifted: &Lifted) -> (Ranges, Ranges) {
        let p = lifted.cols;
        let (mut e, mut r) = (
            Ranges::all(p, -1.0, 1.0),
            Ranges::all(p, f64::NEG_INFINITY, f64::INFINITY),
        );
        let all: Vec<usize> = (0..p).collect();
        for _ in 0..SWEEPS {
            for i in lifted.n..lifted.rows.len() {
                let row = &lifted.rows[i];
                let (low, high, size) = reach(row, &e);
                let (b, delta) = (-lifted.offset[i], lifted.slack[i]);
                let margin = delta + gamma(p + 8) * (size + b.abs() + delta) + ETA;
                let margin = margin * (1.0 + 8.0 * U);
                let support: Vec<usize> = all.iter().copied().filter(|&j| row[j] != 0.0).collect();
                let (inner, outer) = ([b - margin, b + margin], [low, high]);
                let mut narrowed = Narrowed::none(p);
                assert!(!confine(
                    row,
                    &support,
                    inner,
                    outer,
                    &mut e,
                    &mut r,
                    &mut narrowed,
                    1
                ));
            }
        }
        (e, r)
    }

    #[test]
    fn ranges_that_leave_rows_out_are_those_of_whole_sweeps() {
        let mut narrow = 0;
        for seed in 0..40 {
            let (q, p) = (1 + seed as usize % 9, 12 + seed as usize);
            let mut lifted = Lifted::new(&set(2, q, p, seed));
            for _ in 0..q {
                lifted.gauss_jordan().unwrap();
                let (e, r) = lifted.ranges().unwrap();
                let (all_e, all_r) = swept(&lifted);
                narrow += usize::from(e.iter().any(|(lo, hi)| lo > -1.0 || hi < 1.0));
                assert_eq!((e, r), (all_e, all_r));
                let errors = lifted.rescale().unwrap();
                let Some(j) = lifted.cheapest(&errors) else {
                    break;
                };
                lifted.eliminate(j);
            }
        }
        assert!(narrow > 20, "{narrow} sets with a narrowed range");
    }
}
