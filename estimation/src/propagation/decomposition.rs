//! Remainder-form decomposition: a function of several variables as a linear part and a bounded rest.
//!
//! For a scalar f on a box z ∈ [l, u] whose gradient lies in J there, choose for every component "lower",
//! m_j ≤ J_j, or "upper", m_j ≥ J_j. Then g = f − mᵀz does not fall in z_j (lower) or does not rise in it
//! (upper), and with z⁺_j = u_j, z⁻_j = l_j (lower) or the other way round (upper)
//!
//! g(z) ∈ \[f(z⁻) − mᵀz⁻, f(z⁺) − mᵀz⁺\],
//!
//! which is tight. J must hold on the whole box. A component in which f is affine takes m_j from the middle
//! of J_j, and what its rounding leaves is charged by |J_j − m_j| (u_j − l_j).
//!
//! This is Corollary 1 of \[Khajenejad\] with its bounds corrected: the printed ones are those of f, not of
//! g, and its ζ⁺ has the corners exchanged.
//!
//! Source: \[Khajenejad, Prop. 4, Cor. 1, Props. 3 and 5\].

use serde::{Deserialize, Serialize};
use zonobench_sets::interval_matrix::{hessian_over, jacobian_over};
use zonobench_sets::number::Function;
use zonobench_sets::{Frame, Interval, IntervalMatrix, IntervalVector, List, Matrix, SetError};

/// Which numbers "lower" and "upper" are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Vectors {
    /// min(J_j, 0) and max(J_j, 0) of the bounds of J_j: the set of the paper, Eq. (6).
    #[default]
    Paper,
    /// The bounds of J_j themselves: tighter where a derivative keeps its sign.
    Signed,
}

/// Which of the 2ⁿ vectors of a row are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Choose {
    /// The one whose remainder is narrowest, the first of equals.
    #[default]
    Argmin,
    /// All.
    All,
}

/// How the Jacobian is bounded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JacobianBounds {
    /// By its own interval evaluation.
    #[default]
    Natural,
    /// Every entry by the decomposition of that entry, with its gradient from the interval Hessian,
    /// intersected with the natural bound (Prop. 5).
    Decomposition,
}

/// Which vectors, how many of them, and from which bounds of the Jacobian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recipe {
    /// What "lower" and "upper" are.
    pub vectors: Vectors,
    /// One vector of each row, or all.
    pub choose: Choose,
    /// How the Jacobian is bounded.
    pub jacobian: JacobianBounds,
}

/// f(z) − mᵀz ∈ `remainder` for every z of the box it was made over.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// m.
    pub linear: Vec<f64>,
    /// Where f(z) − mᵀz lies.
    pub remainder: Interval,
}

impl Relation {
    /// The relation in x, where it was made in the frame's t = C x: f(x) − M x ∈ remainder with M ≈ mᵀC; the
    /// rounding of M is charged over the frame's hull.
    pub fn in_state(&self, frame: &Frame) -> Self {
        if frame.is_identity() {
            return self.clone();
        }
        let n = self.linear.len();
        let hull = frame.hull();
        let mut linear = vec![0.0; n];
        let mut remainder = self.remainder;
        for (j, m) in linear.iter_mut().enumerate() {
            let exact = (0..n).fold(Interval::ZERO, |s, k| {
                s + Interval::point(self.linear[k]) * Interval::point(frame.to()[(k, j)])
            });
            *m = exact.mid();
            remainder = remainder + (exact - Interval::point(*m)) * hull[j];
        }
        Self { linear, remainder }
    }
}

/// A derivative whose radius is this small beside it is constant but for rounding.
const CONSTANT: f64 = 1e-12;

/// At most this many components are chosen both ways: 2⁶ vectors a row. Of more, those where |J_j|'s width
/// times the side's is largest, and "lower" for the rest.
const FREE: usize = 6;

/// The corners of a box over the components that matter; the others stand in the middle.
struct Corners {
    active: Vec<usize>,
    range: IntervalVector,
}

impl Corners {
    /// Fails with `Range` where more components matter than a number has bits.
    fn new(active: Vec<usize>, range: IntervalVector) -> Result<Self, SetError> {
        if active.len() >= usize::BITS as usize {
            return Err(SetError::Range {
                op: "decomposition",
                what: "the number of components in which the function is not affine",
                expected: "at most 63",
                got: active.len() as f64,
            });
        }
        Ok(Self { active, range })
    }

    /// Corner `bits`: component active[a] at its upper bound if bit a is set.
    fn at(&self, bits: usize) -> List<f64> {
        let mut z = self.range.mid();
        for (a, &j) in self.active.iter().enumerate() {
            let side = self.range[j];
            z[j] = if bits >> a & 1 == 1 {
                side.hi()
            } else {
                side.lo()
            };
        }
        z
    }
}

fn is_affine(derivative: Interval) -> bool {
    derivative.rad() <= CONSTANT * derivative.mag()
}

/// The components of a row that are chosen both ways, in ascending order.
fn free(gradient: &[Interval], range: &IntervalVector) -> Vec<usize> {
    let mut free: Vec<usize> = (0..gradient.len())
        .filter(|&j| !is_affine(gradient[j]))
        .collect();
    if free.len() > FREE {
        let weight = |j: usize| gradient[j].width() * range[j].width();
        free.sort_by(|&i, &j| weight(j).total_cmp(&weight(i)));
        free.truncate(FREE);
        free.sort_unstable();
    }
    free
}

/// One vector m of a row, and the corners where f − mᵀz is least and greatest.
struct Vector {
    linear: Vec<f64>,
    minus: usize,
    plus: usize,
}

/// The vectors of a row whose gradient lies in `gradient`, and what the components in which it is affine but
/// for rounding add to every remainder.
///
/// In lexicographic order, the first component the most significant and lower before upper.
fn vectors_of(gradient: &[Interval], corners: &Corners, vectors: Vectors) -> (Vec<Vector>, f64) {
    let range = &corners.range;
    let free = free(gradient, range);
    let bounds = |j: usize| match vectors {
        Vectors::Signed => [gradient[j].lo(), gradient[j].hi()],
        Vectors::Paper => [gradient[j].lo().min(0.0), gradient[j].hi().max(0.0)],
    };
    let mut charge = 0.0;
    let mut linear = vec![0.0; gradient.len()];
    let mut varying = Vec::new();
    for (j, &derivative) in gradient.iter().enumerate() {
        if is_affine(derivative) {
            linear[j] = derivative.mid();
            let rest = derivative - Interval::point(linear[j]);
            if rest.mag() > 0.0 {
                charge = (charge + rest.mag() * range[j].width() * (1.0 + 1e-12)).next_up();
            }
        } else {
            varying.push(j);
        }
    }
    let choices = 0..1usize << free.len();
    let all = choices.map(|s| {
        let (mut plus, mut minus) = (0, 0);
        for &j in &varying {
            let upper = free
                .iter()
                .position(|&i| i == j)
                .is_some_and(|a| s >> (free.len() - 1 - a) & 1 == 1);
            linear[j] = bounds(j)[usize::from(upper)];
            let bit = corners
                .active
                .iter()
                .position(|&i| i == j)
                .map_or(0, |a| 1 << a);
            if upper {
                minus |= bit;
            } else {
                plus |= bit;
            }
        }
        Vector {
            linear: linear.clone(),
            minus,
            plus,
        }
    });
    (all.collect(), charge)
}

/// The relations of the vectors of one row: `value(corner)` is f there.
fn row(
    value: impl Fn(usize) -> Interval,
    (vectors, charge): (Vec<Vector>, f64),
    corners: &Corners,
) -> Vec<Relation> {
    let relation = |vector: Vector| {
        let rest = |bits: usize| {
            let z = corners.at(bits);
            let along = vector.linear.iter().zip(&z).filter(|(m, _)| **m != 0.0);
            along.fold(value(bits), |s, (&m, &z)| {
                s - Interval::point(m) * Interval::point(z)
            })
        };
        let ends = rest(vector.minus).hull(&rest(vector.plus));
        Relation {
            remainder: if charge > 0.0 {
                ends + Interval::from_center_radius(0.0, charge)
            } else {
                ends
            },
            linear: vector.linear,
        }
    };
    vectors.into_iter().map(relation).collect()
}

/// The corners that the vectors need, in ascending order and each once, and what `at` says of them.
fn at_corners<'a, T>(
    vectors: impl Iterator<Item = &'a Vector>,
    at: impl FnMut(usize) -> Result<T, SetError>,
) -> Result<(Vec<usize>, Vec<T>), SetError> {
    let mut needed: Vec<usize> = vectors.flat_map(|v| [v.minus, v.plus]).collect();
    needed.sort_unstable();
    needed.dedup();
    let values = needed.iter().copied().map(at).collect::<Result<_, _>>()?;
    Ok((needed, values))
}

/// What was said of the corner `bits`.
fn known<T>((corners, values): &(Vec<usize>, Vec<T>), bits: usize) -> &T {
    let at = corners.binary_search(&bits);
    &values[at.expect("every corner of every vector was asked for")]
}

/// Remainders whose widths differ by less than this are equally wide: equalities that hold in exact
/// arithmetic, as for functions linear in each variable, are not to be decided by rounding.
const EQUALLY_WIDE: f64 = 1e-9;

/// The relation with the narrowest remainder; of those that are equal the one whose linear part reaches least over the box
/// `range` that they were made over, Σ_j |m_j| (u_j − l_j), because m multiplies a set, and of those the first.
pub fn narrowest<'a>(relations: &'a [Relation], range: &IntervalVector) -> &'a Relation {
    let size = |r: &Relation| {
        let terms = r.linear.iter().zip(range);
        terms.map(|(m, side)| m.abs() * side.width()).sum::<f64>()
    };
    let mut best = &relations[0];
    for relation in &relations[1..] {
        let (width, least) = (relation.remainder.width(), best.remainder.width());
        let equal = (width - least).abs() <= EQUALLY_WIDE * least;
        let smaller = size(relation) < size(best) * (1.0 - EQUALLY_WIDE);
        if (equal && smaller) || (!equal && width < least) {
            best = relation;
        }
    }
    best
}

/// For every row of f all relations f_i(x) − mᵀt ∈ remainder over the frame's box, t = C x.
///
/// `gradient` must contain the Jacobian in t over that box ([`jacobian_bounds`]). Fails with `Domain` where
/// f may be undefined at a corner.
pub fn relations<F: Function>(
    f: &F,
    frame: &Frame,
    gradient: &IntervalMatrix,
    vectors: Vectors,
) -> Result<Vec<Vec<Relation>>, SetError> {
    const OP: &str = "corners of a box";
    let (n, m) = (f.inputs(), f.outputs());
    let active: Vec<usize> = (0..n)
        .filter(|&j| (0..m).any(|i| !is_affine(gradient[(i, j)])))
        .collect();
    let corners = Corners::new(active, frame.range().clone())?;
    let rows: Vec<_> = (0..m)
        .map(|i| vectors_of(gradient.row(i), &corners, vectors))
        .collect();
    let values = at_corners(rows.iter().flat_map(|(row, _)| row), |bits| {
        let x = in_state(frame, &corners.at(bits))?;
        let mut value = vec![Interval::ZERO; m];
        f.evaluate(x.as_slice(), &mut value);
        IntervalVector::new(value).finite(OP)
    })?;
    let relations = rows.into_iter().enumerate();
    let relations = relations.map(|(i, r)| row(|bits| known(&values, bits)[i], r, &corners));
    Ok(relations.collect())
}

/// The relations of every row that the recipe chooses, `gradient` as in [`relations`].
///
/// Fails as [`relations`].
pub fn chosen_relations<F: Function>(
    f: &F,
    frame: &Frame,
    gradient: &IntervalMatrix,
    recipe: Recipe,
) -> Result<Vec<Vec<Relation>>, SetError> {
    let rows = relations(f, frame, gradient, recipe.vectors)?;
    Ok(match recipe.choose {
        Choose::All => rows,
        Choose::Argmin => {
            let one = |r: &Vec<Relation>| vec![narrowest(r, frame.range()).clone()];
            rows.iter().map(one).collect()
        }
    })
}

/// At most this many combinations of one relation a row are made.
const MOST_COMBINATIONS: usize = 1024;

/// One relation a row, in all combinations: one a matrix H of \[Khajenejad, Eq. (9)\].
///
/// Fails with `Range` for more than 1024.
pub fn combinations(rows: &[Vec<Relation>]) -> Result<Vec<Vec<&Relation>>, SetError> {
    let count = rows
        .iter()
        .fold(1usize, |n, row| n.saturating_mul(row.len()));
    if count > MOST_COMBINATIONS {
        return Err(SetError::Range {
            op: "combinations of all vectors of all rows",
            what: "their number",
            expected: "at most 1024 (choose = \"argmin\" has one)",
            got: count as f64,
        });
    }
    let mut all: Vec<Vec<&Relation>> = vec![Vec::new()];
    for row in rows {
        all = all
            .iter()
            .flat_map(|c| row.iter().map(move |r| [&c[..], &[r]].concat()))
            .collect();
    }
    Ok(all)
}

/// The Jacobian in the frame's coordinates t over its box: J C⁻¹, with the entries of J bounded in x over the
/// frame's hull as `how` says.
///
/// Fails with `Domain` where f or a derivative may be undefined.
pub fn jacobian_bounds<F: Function>(
    f: &F,
    frame: &Frame,
    how: JacobianBounds,
    vectors: Vectors,
) -> Result<IntervalMatrix, SetError> {
    let over = frame.hull();
    let j = match how {
        JacobianBounds::Natural => jacobian_over(f, &over)?.1,
        JacobianBounds::Decomposition => decomposed_jacobian(f, over, vectors)?,
    };
    Ok(if frame.is_identity() {
        j
    } else {
        j.mul(frame.back())
    })
}

/// Every entry of the Jacobian over the box by its own decomposition, which its natural bounds are
/// intersected with.
fn decomposed_jacobian<F: Function>(
    f: &F,
    over: IntervalVector,
    vectors: Vectors,
) -> Result<IntervalMatrix, SetError> {
    let (_, natural, second) = hessian_over(f, &over)?;
    let (n, m) = (f.inputs(), f.outputs());
    let depends = |j: &usize| {
        let mut entries = second.iter().flat_map(|h| (0..n).map(move |i| h[(i, *j)]));
        entries.any(|h| h != Interval::ZERO)
    };
    let corners = Corners::new((0..n).filter(depends).collect(), over)?;
    if corners.active.is_empty() {
        return Ok(natural);
    }
    let rows = second.iter().flat_map(|h| (0..n).map(|j| h.row(j)));
    let entries: Vec<_> = rows
        .map(|gradient| {
            let varies = gradient.iter().any(|h| *h != Interval::ZERO);
            varies.then(|| vectors_of(gradient, &corners, vectors))
        })
        .collect();
    let vectors = entries.iter().flatten().flat_map(|(v, _)| v);
    let at = at_corners(vectors, |bits| {
        Ok(jacobian_over(f, &IntervalVector::point(&corners.at(bits))?)?.1)
    })?;
    let mut entries = entries.into_iter();
    Ok(IntervalMatrix::from_fn(m, n, |i, j| {
        let vectors = entries.next().expect("one an entry, in this order");
        let relations = vectors.map(|v| row(|bits| known(&at, bits)[(i, j)], v, &corners));
        relations
            .into_iter()
            .flatten()
            .fold(natural[(i, j)], |bound, relation| {
                let terms = relation.linear.iter().zip(&corners.range);
                let value = terms
                    .filter(|(m, _)| **m != 0.0)
                    .fold(relation.remainder, |s, (&m, &z)| s + Interval::point(m) * z);
                // Both contain the entry, so they meet.
                bound.intersect(&value).unwrap_or(bound)
            })
    }))
}

/// Contains C⁻¹ t.
fn in_state(frame: &Frame, t: &[f64]) -> Result<IntervalVector, SetError> {
    let t = IntervalVector::point(t)?;
    Ok(if frame.is_identity() {
        t
    } else {
        frame.back().mul_vec(&t)
    })
}

/// f_i(x) − (mid J)_i x ∈ f_i(h) − (mid J)_i h + (J − mid J)_i (X − h) for x in the box, h its middle.
///
/// `jacobian` must contain the Jacobian over the box. Fails with `Domain` where f may be undefined at h.
///
/// Source: \[Khajenejad, Prop. 3\].
pub fn mean_value_relations<F: Function>(
    f: &F,
    over: &IntervalVector,
    jacobian: &IntervalMatrix,
) -> Result<Vec<Relation>, SetError> {
    let h = IntervalVector::point(&over.mid())?;
    let mut value = vec![Interval::ZERO; f.outputs()];
    f.evaluate(h.as_slice(), &mut value);
    let value = IntervalVector::new(value).finite("middle of a box")?;
    let from_h = over.difference(&h)?;
    Ok((0..f.outputs())
        .map(|i| {
            let linear: Vec<f64> = jacobian.row(i).iter().map(|j| j.mid()).collect();
            let mut remainder = value[i];
            for (k, (&m, &j)) in linear.iter().zip(jacobian.row(i)).enumerate() {
                let middle = Interval::point(m);
                if m != 0.0 {
                    remainder = remainder - middle * h[k];
                }
                if !j.is_point() {
                    remainder = remainder + (j - middle) * from_h[k];
                }
            }
            Relation { linear, remainder }
        })
        .collect())
}

/// The matrix of the linear parts, one row a relation.
pub fn linear_parts(relations: &[&Relation]) -> Matrix {
    let n = relations.first().map_or(0, |r| r.linear.len());
    Matrix::from_fn(relations.len(), n, |i, j| relations[i].linear[j])
}
