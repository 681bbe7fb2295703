//! Section II and the appendices: zonotopes, SE(2), the linear error dynamic.

use super::claim;
use crate::exact::{Cz, M, Q, Source, V, dot, frac, norm1, q, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "properties-2.1-2.3",
            "sum and image of zonotopes, and the reduction of Remark 1 encloses",
            "",
            zonotopes,
        ),
        claim(
            "exp-log",
            "exp and log between SE(2) and its algebra are bijective",
            "only for headings below pi: log is refused beyond",
            bijective,
        ),
        claim(
            "lemma-2.1",
            "f(X1)^-1 f(X2) = g(X1^-1 X2), and g(exp(e)) = exp(A e) + O(|e|^2)",
            "the second is exact, without a remainder, with A = Ad(exp(-delta u))",
            group_affine,
        ),
        claim(
            "appendix-C",
            "A = I - delta ad(u)",
            "exact for omega = 0 only: Ad(exp(-delta u)) has to be used",
            adjoint,
        ),
        claim(
            "remark-5",
            "with the alternative innovation C is constant (left and right action)",
            "for the left action only",
            constant_output,
        ),
        claim(
            "equations-14-18",
            "the model (14) is written on the group as (18)",
            "a guarantee needs the truth of (18), or a wider W",
            models,
        ),
    ]
}

/// R_s(H) of Remark 1.
pub fn reduced(h: &M, s: usize) -> M {
    let (d, m) = (h.rows(), h.cols());
    if m <= s {
        return h.clone();
    }
    let mut order: Vec<usize> = (0..m).collect();
    let size: V = (0..m)
        .map(|j| {
            let c = h.col(j);
            dot(&c, &c)
        })
        .collect();
    order.sort_by(|&a, &b| size[b].cmp(&size[a]));
    let kept = M::from_fn(d, s - d, |i, j| h[(i, order[j])].clone());
    let rest = &order[s - d..];
    let sums: V = (0..d)
        .map(|i| rest.iter().fold(Q::zero(), |sum, &j| sum + h[(i, j)].abs()))
        .collect();
    kept.beside(&M::diag(&sums))
}

fn zonotopes(t: &mut Trial) {
    for _ in 0..300 {
        let (a, b) = (t.draw.matrix(3, 5, 3), t.draw.matrix(3, 4, 3));
        let d = t.draw.direction(3, 3);
        let support = |h: &M, d: &[Q]| norm1(&h.t().apply(d));
        t.check(support(&a.beside(&b), &d) == support(&a, &d) + support(&b, &d));
        let l = t.draw.matrix(2, 3, 2);
        let e = t.draw.direction(2, 3);
        t.check(support(&l.mul(&a), &e) == support(&a, &l.t().apply(&e)));
        let all = a.beside(&b);
        let small = reduced(&all, 6);
        t.check(small.cols() == 6 && support(&small, &d) >= support(&all, &d));
        let point = all.apply(&t.draw.units(all.cols()));
        t.check(Cz::zonotope(small, v(&[0, 0, 0])).contains(&point));
    }
}

/// sin and cos of k quarter turns.
fn quarter(k: i64) -> (i64, i64) {
    [(0, 1), (1, 0), (0, -1), (-1, 0)][k.rem_euclid(4) as usize]
}

/// exp of a heading of k quarter turns with the translation part u is I: R = I and V u = 0. For k ≠ 0 the entries of
/// V are sin/s and (1 − cos)/s.
fn is_identity(k: i64, u: &[Q]) -> bool {
    let (sin, cos) = quarter(k);
    let moved = if k == 0 {
        u.to_vec()
    } else {
        let (a, b) = (q(sin), q(1 - cos));
        vec![&a * &u[0] - &b * &u[1], &b * &u[0] + &a * &u[1]]
    };
    sin == 0 && cos == 1 && moved.iter().all(Zero::is_zero)
}

fn bijective(t: &mut Trial) {
    t.check_or(!is_identity(4, &v(&[0, 0])), || {
        "exp(2 pi, 0, 0) = I = exp(0, 0, 0)".to_owned()
    });
    for _ in 0..400 {
        let k = t.draw.int(-12, 12);
        let u = t.draw.vector(2, 3);
        let zero = k == 0 && u.iter().all(Zero::is_zero);
        t.check(zero || !is_identity(k, &u));
        let k = t.draw.int(-1, 1);
        let zero = k == 0 && u.iter().all(Zero::is_zero);
        t.repaired(zero == is_identity(k, &u));
    }
}

/// An element of SE(2) with a rational rotation.
fn element(draw: &mut Source) -> M {
    let triples = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (0, 1, 1), (1, 0, 1)];
    let (a, b, c) = triples[draw.size(0, triples.len() - 1)];
    let (cos, sin) = (draw.sign() * frac(a, c), draw.sign() * frac(b, c));
    let x = draw.vector(2, 3);
    M::of_rows(
        3,
        &[
            vec![cos.clone(), -sin.clone(), x[0].clone()],
            vec![sin, cos, x[1].clone()],
            v(&[0, 0, 1]),
        ],
    )
}

fn inverse(x: &M) -> M {
    let (r, p) = rotation_and_place(x);
    let back = r.t().apply(&p);
    M::from_fn(3, 3, |i, j| match (i, j) {
        (2, 2) => q(1),
        (2, _) => q(0),
        (_, 2) => -back[i].clone(),
        _ => r[(j, i)].clone(),
    })
}

fn rotation_and_place(x: &M) -> (M, V) {
    (
        M::from_fn(2, 2, |i, j| x[(i, j)].clone()),
        vec![x[(0, 2)].clone(), x[(1, 2)].clone()],
    )
}

/// [ε]^ of (σ, u).
fn wedge(e: &[Q]) -> M {
    M::of_rows(
        3,
        &[
            vec![q(0), -e[0].clone(), e[1].clone()],
            vec![e[0].clone(), q(0), e[2].clone()],
            v(&[0, 0, 0]),
        ],
    )
}

/// Ad_X: X [ε]^ X⁻¹ = [Ad_X ε]^.
fn adjoint_of(x: &M) -> M {
    let (r, p) = rotation_and_place(x);
    M::from_fn(3, 3, |i, j| match (i, j) {
        (0, 0) => q(1),
        (0, _) => q(0),
        (1, 0) => p[1].clone(),
        (2, 0) => -p[0].clone(),
        _ => r[(i - 1, j - 1)].clone(),
    })
}

/// f(X) = X F. The series of exp commutes with conjugation, so g(exp ε) = F⁻¹ exp(ε) F = exp(Ad ε) exactly if
/// F⁻¹ [ε]^ F = [Ad ε]^.
fn group_affine(t: &mut Trial) {
    for _ in 0..200 {
        let [a, b, f] = [(); 3].map(|()| element(&mut t.draw));
        let step = |x: &M| x.mul(&f);
        let left = inverse(&step(&a)).mul(&step(&b));
        let error = inverse(&a).mul(&b);
        t.check(left == inverse(&f).mul(&error).mul(&f));
        // (1): f(X1 X2) = f(X1) f(I)^-1 f(X2).
        let product = step(&a).mul(&inverse(&f)).mul(&step(&b));
        t.check(step(&a.mul(&b)) == product);
        let e = t.draw.vector(3, 3);
        let moved = adjoint_of(&inverse(&f)).apply(&e);
        t.check(inverse(&f).mul(&wedge(&e)).mul(&f) == wedge(&moved));
    }
}

/// A lower bound of (1 − cos s)/s for 0 < s ≤ 1: s/2 − s³/24.
pub fn versine_over(s: &Q) -> Q {
    s / q(2) - s * s * s / q(24)
}

/// Ad(exp(−δu)) has cos(δω) on its diagonal and δν (1 − cos(δω))/(δω) in its lateral row; I − δ ad(u) has 1 and 0.
fn adjoint(t: &mut Trial) {
    let lateral = |s: &Q, distance: &Q| distance * versine_over(s);
    let missing = lateral(&frac(4, 1000), &frac(8, 100));
    t.check_or(!missing.is_positive(), || {
        format!(
            "delta = .01, omega = .4, nu = 8: the lateral row of Ad(exp(-delta u)) has at least {missing} per rad, \
             I - delta ad(u) has 0"
        )
    });
    for _ in 0..300 {
        let s = frac(t.draw.int(0, 20), 20);
        let distance = q(t.draw.int(1, 8));
        // 1 − cos s ≥ s²/2 − s⁴/24 > 0 unless s = 0.
        let equal = !lateral(&s, &distance).is_positive();
        t.check(equal);
        if s.is_zero() {
            let f = M::of_rows(
                3,
                &[
                    vec![q(1), q(0), distance.clone()],
                    v(&[0, 1, 0]),
                    v(&[0, 0, 1]),
                ],
            );
            let linear = M::of_rows(
                3,
                &[v(&[1, 0, 0]), v(&[0, 1, 0]), vec![distance, q(0), q(1)]],
            );
            t.repaired(adjoint_of(&inverse(&f)) == linear);
        }
    }
}

/// z = X̂⁻¹ X b − b to first order in ε: left, X = X̂ exp ε, it is [ε]^ b; right, X = exp(ε) X̂, X̂⁻¹ [ε]^ X̂ b.
fn constant_output(t: &mut Trial) {
    let b = v(&[0, 0, 1]);
    let unit = M::identity(3);
    let right = |x: &M| {
        let columns: Vec<V> = (0..3)
            .map(|j| inverse(x).mul(&wedge(unit.row(j))).mul(x).apply(&b))
            .collect();
        M::from_fn(2, 3, |i, j| columns[j][i].clone())
    };
    let left = |x: &M| {
        let columns: Vec<V> = (0..3)
            .map(|j| inverse(x).mul(x).mul(&wedge(unit.row(j))).apply(&b))
            .collect();
        M::from_fn(2, 3, |i, j| columns[j][i].clone())
    };
    let at = |x: i64| M::of_rows(3, &[v(&[1, 0, x]), v(&[0, 1, 0]), v(&[0, 0, 1])]);
    let (first, second) = (right(&at(0)), right(&at(1)));
    t.check_or(first == second, || {
        format!(
            "right action, heading 0: C = {} at x = (0, 0) and {} at (1, 0)",
            first.text(),
            second.text()
        )
    });
    for _ in 0..200 {
        let (a, b) = (element(&mut t.draw), element(&mut t.draw));
        t.check(right(&a) == right(&b));
        t.repaired(left(&a) == left(&b) && left(&a) == M::ints(&[&[0, 1, 0], &[0, 0, 1]]));
    }
}

/// One step from the origin without noise: (14) goes straight, (18) sideways by δν (1 − cos(δω))/(δω).
fn models(t: &mut Trial) {
    let sideways = |s: &Q, distance: &Q| distance * versine_over(s);
    let gap = sideways(&frac(4, 1000), &frac(8, 100));
    t.check_or(!gap.is_positive(), || {
        format!(
            "delta = .01, omega = .4, nu = 8, heading 0: (14) moves sideways by 0, (18) by at least {gap}, 16 % of \
             the bound .001 of the noise"
        )
    });
    for _ in 0..300 {
        let s = frac(t.draw.int(0, 20), 20);
        let same = !sideways(&s, &q(t.draw.int(1, 8))).is_positive();
        t.check(same);
        if s.is_zero() {
            t.repaired(same);
        }
    }
}
