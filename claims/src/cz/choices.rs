//! Section 4.3: the choice of h.

use super::claim;
use super::extensions::{Damage, Intervals, Quadratic, eliminated, inclusion_by, inclusion_of};
use super::sets::weighted_closest;
use crate::exact::{Cz, M, Q, Source, V, add, dot, frac, norm1, q, scale, sub, text, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "section-4.3-center",
            "what (17) does but for the center is independent of the center of the set",
            "",
            |t| independence(t, false),
        )
        .twin("the center moved by half of h", |t| independence(t, true)),
        claim(
            "corollary-1",
            "with h of (18) in X, (J, X - h) is contained in (J, X - h~) for any h~ in X",
            "not as an inclusion: nested once both are moved back by mid(J) h and mid(J) h~, hence Theorem 2's enclosure with \
             mu(h, W) exact is contained in that of h~",
            |t| least_enclosure(t, false),
        )
        .twin("a point of X for the h of (18)", |t| least_enclosure(t, true)),
        claim(
            "lemma-1",
            "h solves (20), the least sum of the widths of m, iff it solves the linear program (21)",
            "",
            |t| linear_program(t, Change::None),
        )
        .twin("row sums of diam(J) for its column sums", |t| {
            linear_program(t, Change::Rows);
        })
        .twin("the shift by rescaling left out of p", |t| {
            linear_program(t, Change::Shift);
        }),
        claim(
            "lemma-1-optimal",
            "(ours) the h of Lemma 1 also gives the least area",
            "the least sum of P_ii, as the paper says, is not the least area: C2 can be beaten",
            |t| least_area(t, false),
        )
        .class(Class::Remark)
        .twin("another point of X for the h of Lemma 1", |t| {
            least_area(t, true);
        }),
        claim(
            "remark-9",
            "if the h of Corollary 1 belongs to X, it is a solution of (21)",
            "the only one if no column of J is a point: the program needs a rule for ties",
            |t| coincides(t, false),
        )
        .twin("the center of X for the h of Corollary 1", |t| coincides(t, true)),
    ]
}

/// E ∩ [−1, 1]ⁿ after one pass over the rows: what each row leaves of a coordinate, the others in their ranges.
fn ranges(z: &Cz) -> (V, V) {
    let n = z.g.cols();
    let (mut low, mut high) = (vec![q(-1); n], vec![q(1); n]);
    for i in 0..z.a.rows() {
        for j in 0..n {
            let pivot = &z.a[(i, j)];
            if pivot.is_zero() {
                continue;
            }
            let (mut least, mut most) = (z.b[i].clone(), z.b[i].clone());
            for k in (0..n).filter(|&k| k != j) {
                let (a, b) = (&z.a[(i, k)] * &low[k], &z.a[(i, k)] * &high[k]);
                least -= a.clone().max(b.clone());
                most -= a.min(b);
            }
            let (a, b) = (least / pivot, most / pivot);
            low[j] = low[j].clone().max(a.clone().min(b.clone()));
            high[j] = high[j].clone().min(a.max(b));
        }
    }
    (low, high)
}

/// (17): Gauss-Jordan elimination with full pivoting, rescaling and the elimination of one constraint, until none is left.
/// The zonotope, and the shift Σ (Ḡ ξ_m + Λ_G b̃) of the center without the first term, and that term.
fn reduced(x: &Cz) -> (Cz, V, V) {
    let n = x.c.len();
    let mut z = x.clone();
    let (mut rest, mut rescaled) = (vec![Q::zero(); n], vec![Q::zero(); n]);
    while z.a.rows() > 0 {
        preconditioned(&mut z);
        let (low, high) = ranges(&z);
        let middle = scale(&frac(1, 2), &add(&low, &high));
        let radius = M::diag(&scale(&frac(1, 2), &sub(&high, &low)));
        rescaled = add(&rescaled, &z.g.apply(&middle));
        z = Cz {
            g: z.g.mul(&radius),
            c: add(&z.c, &z.g.apply(&middle)),
            a: z.a.mul(&radius),
            b: sub(&z.b, &z.a.apply(&middle)),
        };
        // The last constraint goes, with its first column that is not 0.
        let last = z.a.rows() - 1;
        let kept: Vec<usize> = (0..last).collect();
        let Some(j) = (0..z.g.cols()).find(|&j| !z.a[(last, j)].is_zero()) else {
            z.a = M::from_fn(last, z.a.cols(), |r, k| z.a[(kept[r], k)].clone());
            z.b.truncate(last);
            continue;
        };
        let value = z.a[(last, j)].recip();
        let (row, b) = (z.a.row(last).to_vec(), z.b[last].clone());
        let step = scale(&(&value * &b), &z.g.col(j));
        rest = add(&rest, &step);
        let columns: Vec<usize> = (0..z.g.cols()).filter(|&k| k != j).collect();
        let without = |m: &M, rows: usize| {
            M::from_fn(rows, columns.len(), |r, k| {
                &m[(r, columns[k])] - &m[(r, j)] * &value * &row[columns[k]]
            })
        };
        let right = (0..last).map(|r| &z.b[r] - &z.a[(r, j)] * &value * &b);
        z = Cz {
            g: without(&z.g, n),
            c: add(&z.c, &step),
            b: right.collect(),
            a: without(&z.a, last),
        };
    }
    (z, rest, rescaled)
}

/// Gauss-Jordan elimination of [A b] with full pivoting.
fn preconditioned(z: &mut Cz) {
    let (rows, cols) = (z.a.rows(), z.a.cols());
    let mut table = z.a.beside(&M::from_fn(rows, 1, |i, _| z.b[i].clone()));
    let mut used: Vec<usize> = Vec::new();
    for r in 0..rows {
        let entries = (r..rows).flat_map(|i| (0..cols).map(move |j| (i, j)));
        let pivot = entries
            .filter(|&(i, j)| !used.contains(&j) && !table[(i, j)].is_zero())
            .min_by_key(|&(i, j)| (std::cmp::Reverse(table[(i, j)].abs()), i, j));
        let Some((i, j)) = pivot else { break };
        used.push(j);
        let order: Vec<usize> = (0..rows)
            .map(|k| {
                if k == r {
                    i
                } else if k == i {
                    r
                } else {
                    k
                }
            })
            .collect();
        let lead = table[(i, j)].clone();
        let top: V = table.row(i).iter().map(|x| x / &lead).collect();
        table = M::from_fn(rows, cols + 1, |k, c| {
            if k == r {
                top[c].clone()
            } else {
                &table[(order[k], c)] - &table[(order[k], j)] * &top[c]
            }
        });
    }
    z.a = M::from_fn(rows, cols, |i, j| table[(i, j)].clone());
    z.b = table.col(cols);
}

/// Up to two constraints.
fn with_constraints(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(1, 2);
    draw.cz(n, n + 1 + constraints, constraints)
}

fn independence(t: &mut Trial, damaged: bool) {
    for _ in 0..80 {
        let n = t.draw.size(1, 2);
        let x = with_constraints(&mut t.draw, n);
        let h = t.draw.direction(n, 3);
        let (own, ..) = reduced(&x);
        let (moved, ..) = reduced(&x.about(&h));
        let by = if damaged { scale(&frac(1, 2), &h) } else { h };
        t.check(own.g == moved.g && sub(&own.c, &by) == moved.c);
    }
}

fn absolute(x: &[Q]) -> V {
    x.iter().map(Signed::abs).collect()
}

fn drawn(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(0, 1);
    let generators = n + 1 + constraints;
    draw.cz(n, generators, constraints)
}

fn least_enclosure(t: &mut Trial, damaged: bool) {
    let x = Cz::boxed(v(&[0]), &[q(1)]);
    for rad in [Q::zero(), frac(1, 10)] {
        let j = Intervals {
            mid: M::identity(1),
            rad: M::diag(std::slice::from_ref(&rad)),
        };
        let own = inclusion_of(&j, &x, &x);
        let other = x.about(&v(&[1]));
        let moved = inclusion_of(&j, &other, &other);
        let hulls = own.hull().zip(moved.hull()).unwrap_or_default();
        t.check_or(hulls.0[0].1 <= hulls.1[0].1, || {
            format!(
                "X = [-1, 1], J = 1, h = 0, h~ = 1: [{}, {}] is not in [{}, {}]; with J = [9/10, 11/10] not either, [-11/10, \
                 11/10] and [-11/5, 1/5]",
                hulls.0[0].0, hulls.0[0].1, hulls.1[0].0, hulls.1[0].1
            )
        });
    }
    for _ in 0..120 {
        let n = t.draw.size(1, 2);
        let x = drawn(&mut t.draw, n);
        let center = eliminated(&x).c;
        let mut points = x.points(&mut t.draw, 3);
        let h = if damaged {
            points.pop()
        } else {
            Some(center.clone()).filter(|h| x.contains(h))
        };
        let Some(h) = h else { continue };
        let f = Quadratic::drawn(&mut t.draw, n, 1);
        let Some(hull) = x.hull() else { continue };
        let j = f.gradient(&hull);
        let at = |h: &[Q]| {
            let moved = x.about(h);
            inclusion_by(&j, &moved, &eliminated(&moved), Damage::None)
        };
        let best = at(&h);
        // The center of the eliminated set is among the others where it is in X, which shows that no other is best.
        points.extend(Some(center).filter(|c| damaged && x.contains(c)));
        for other in points.into_iter().take(2) {
            let second = at(&other);
            let d = t.draw.direction(n, 3);
            let supports = best.support(&d).zip(second.support(&d));
            t.check(supports.as_ref().is_some_and(|(a, b)| a <= b));
            let Some((a, b)) = supports else { continue };
            let back = |h: &[Q]| dot(&d, &j.mid.apply(h));
            t.repaired(back(&h) + &a <= back(&other) + &b);
            let zero = [Q::zero()];
            t.repaired(dot(&d, &f.at(&h, &zero)) + a <= dot(&d, &f.at(&other, &zero)) + b);
        }
    }
}

/// Σᵢ rad Jᵢⱼ for each j.
fn weights(j: &Intervals) -> V {
    j.rad.t().row_sums()
}

/// What the twins of Lemma 1 change.
#[derive(Clone, Copy, PartialEq)]
enum Change {
    None,
    Rows,
    Shift,
}

/// The objective of (21) beside the sum of the widths of m, found by eliminating the constraints of X − h itself and by
/// interval arithmetic: they are equal at every h of X, so that the two programs have the same solutions.
fn linear_program(t: &mut Trial, change: Change) {
    for _ in 0..60 {
        let n = t.draw.size(1, 2);
        let x = with_constraints(&mut t.draw, n);
        let j = Intervals {
            mid: M::zeros(n, n),
            rad: t.draw.matrix(n, n, 2).abs(),
        };
        let (_, rest, rescaled) = reduced(&x);
        let mut center = add(&x.c, &rest);
        if change != Change::Shift {
            center = add(&center, &rescaled);
        }
        let theta = if change == Change::Rows {
            j.rad.row_sums()
        } else {
            weights(&j)
        };
        let widths = |h: &[Q]| {
            let p = reduced(&x.about(h)).0.c;
            (0..n).fold(Q::zero(), |sum, i| {
                let (mut low, mut high) = (Q::zero(), Q::zero());
                for k in 0..n {
                    // [-r, r] p
                    let end = (&j.rad[(i, k)] * &p[k]).abs();
                    low -= &end;
                    high += &end;
                }
                sum + high - low
            })
        };
        let Some((h, value)) = weighted_closest(&x, &center, &theta) else {
            t.check(false);
            continue;
        };
        t.check(x.contains(&h) && widths(&h) == q(2) * &value);
        for other in x.points(&mut t.draw, 4) {
            let objective = dot(&theta, &absolute(&sub(&center, &other))) * q(2);
            let own = widths(&other);
            t.check(own == objective && own >= q(2) * &value);
        }
    }
}

/// The product of P_ii of (12): a quarter of the area of P B in the plane.
fn area(j: &Intervals, outer: &Cz, h: &[Q]) -> Q {
    let moved = outer.about(h);
    let own = j.rad.apply(&absolute(&moved.c));
    let spread = j.rad.mul(&moved.g.abs()).row_sums();
    (&own[0] + &spread[0]) * (&own[1] + &spread[1])
}

fn least_area(t: &mut Trial, damaged: bool) {
    // X = {(t, 1 − t)}, a zonotope X̄ ⊇ X, J = [−1, 1] × diag(1, 2).
    let outer = Cz::boxed(v(&[0, 0]), &v(&[1, 10]));
    let j = Intervals {
        mid: M::zeros(2, 2),
        rad: M::ints(&[&[1, 0], &[0, 2]]),
    };
    let x = Cz {
        g: M::ints(&[&[1], &[-1]]).scale(&Q::new(1.into(), 2.into())),
        c: vec![Q::new(1.into(), 2.into()); 2],
        a: M::zeros(0, 1),
        b: Vec::new(),
    };
    if let Some((h, _)) = weighted_closest(&x, &outer.c, &weights(&j)) {
        let other = v(&[0, 1]);
        let (own, best) = (area(&j, &outer, &h), area(&j, &outer, &other));
        t.check_or(own <= best, || {
            format!(
                "mid J = 0, rad J = diag(1, 2), X = {{(t, 1 - t)}}, outer box [-1, 1] x [-10, 10]: the program \
                 gives h = {} with P11 P22 = {own}, h = {} gives {best}",
                text(&h),
                text(&other)
            )
        });
    }
    for k in 0..240 {
        // The zonotope of Remark 3, or any other that Theorem 1 admits: a box about X.
        let mut x = drawn(&mut t.draw, 2);
        let mut outer = eliminated(&x);
        if k % 2 == 0 {
            x = t.draw.cz(2, 1, 0);
            let wider = [q(t.draw.int(0, 10)), q(t.draw.int(0, 10))];
            let r = x.g.row_sums().into_iter().zip(wider);
            outer = Cz::boxed(x.c.clone(), &r.map(|(r, w)| r + w).collect::<V>());
            outer.c = t
                .draw
                .vector(2, 1)
                .iter()
                .zip(&outer.c)
                .map(|(d, c)| d + c)
                .collect();
            outer.g = outer.g.add(&M::identity(2));
        }
        let j = Intervals {
            mid: M::zeros(2, 2),
            rad: t.draw.matrix(2, 2, 3).abs(),
        };
        let Some((h, _)) = weighted_closest(&x, &outer.c, &weights(&j)) else {
            continue;
        };
        let own = area(&j, &outer, &h);
        let others = x.points(&mut t.draw, 6);
        t.check(others.iter().all(|other| area(&j, &outer, other) >= own));
        // What the paper claims: the least sum of P_ii.
        let first = if damaged {
            others.first().unwrap_or(&h)
        } else {
            &h
        };
        let sum = |h: &[Q]| {
            let moved = outer.about(h);
            let own = j.rad.apply(&absolute(&moved.c));
            let spread = j.rad.mul(&moved.g.abs()).row_sums();
            norm1(&own) + norm1(&spread)
        };
        t.repaired(
            others
                .iter()
                .chain([&h])
                .all(|other| sum(other) >= sum(first)),
        );
    }
}

fn coincides(t: &mut Trial, damaged: bool) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let x = with_constraints(&mut t.draw, n);
        let (_, rest, rescaled) = reduced(&x);
        let center = add(&x.c, &add(&rest, &rescaled));
        let h = if damaged { x.c.clone() } else { center.clone() };
        if !x.contains(&h) {
            continue;
        }
        let weight = absolute(&t.draw.vector(n, 2));
        // The objective of (21) at h, from X − h itself, beside its least value.
        let own = dot(&weight, &absolute(&reduced(&x.about(&h)).0.c));
        let least = weighted_closest(&x, &center, &weight).map(|(_, value)| value);
        t.check(least == Some(own));
    }
}
