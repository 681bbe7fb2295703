//! Section 3: set operations, the closest point, the change of centre.

use super::claim;
use crate::exact::{Cz, Lp, M, Q, Source, V, add, dot, frac, norm1, q, scale, sub, text, v};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "section-3.1-parallelotopes",
            "Using ellipsoids or parallelotopes, the linear mapping (4) can be computed exactly",
            "only for invertible R; a map to fewer dimensions has to be over-approximated",
            parallelotopes,
        ),
        claim(
            "equations-8-10",
            "(8)-(10) are the image, the Minkowski sum and the generalized intersection",
            "",
            operations,
        ),
        claim(
            "property-1",
            "2n linear programs give the interval hull",
            "",
            interval_hull,
        ),
        claim(
            "proposition-1",
            "the linear program gives a point of Z that is closest to h in the 1-norm",
            "",
            closest_point,
        ),
        claim(
            "proposition-2",
            "(11) is an equivalent CG-rep of Z with center h",
            "the rows [A E_r, 0] are redundant: n_c + n constraints suffice",
            change_of_center,
        ),
        claim(
            "proposition-2-range",
            "the linear program of Proposition 2 is feasible for h in the range of G (Remark 1)",
            "h - c must be in the range of G",
            range_of_g,
        ),
        claim(
            "remark-1",
            "the linear program is feasible for all h if G is full row rank",
            "",
            full_rank,
        ),
        claim(
            "equation-22",
            "(22) is exact, with n_g + n_gv generators and n_c + n_cv + n_y constraints",
            "",
            update,
        ),
    ]
}

/// Number of vertices of a plane zonotope: two for each direction of its generators.
fn vertices(g: &M) -> usize {
    let columns: Vec<V> = (0..g.cols())
        .map(|j| g.col(j))
        .filter(|c| c.iter().any(|x| !x.is_zero()))
        .collect();
    let parallel = |a: &V, b: &V| (&a[0] * &b[1]) == (&a[1] * &b[0]);
    let directions = (0..columns.len())
        .filter(|&j| (0..j).all(|i| !parallel(&columns[i], &columns[j])))
        .count();
    2 * directions
}

fn parallelotopes(t: &mut Trial) {
    let cube = M::ints(&[&[1, 0, 1], &[0, 1, 1]]);
    t.check_or(vertices(&cube) <= 4, || {
        format!(
            "the cube [-1,1]^3 under R = {} has {} vertices, a parallelogram at most 4",
            cube.text(),
            vertices(&cube)
        )
    });
    for _ in 0..500 {
        let r = t.draw.matrix(2, 3, 2);
        let g = t.draw.matrix(3, 3, 2);
        if g.rank() == 3 {
            t.check(vertices(&r.mul(&g)) <= 4);
        }
        let r = t.draw.matrix(2, 2, 2);
        let g = t.draw.matrix(2, 2, 2);
        t.repaired(vertices(&r.mul(&g)) <= 4);
    }
}

fn set(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(0, 1);
    let generators = draw.size(n, n + 1) + constraints;
    draw.cz(n, generators, constraints)
}

fn operations(t: &mut Trial) {
    for _ in 0..100 {
        let (n, m) = (t.draw.size(1, 2), t.draw.size(1, 2));
        let (z, w, y) = (
            set(&mut t.draw, n),
            set(&mut t.draw, n),
            set(&mut t.draw, m),
        );
        let r = t.draw.matrix(m, n, 2);
        let d = t.draw.direction(m, 3);
        t.check(z.image(&r).support(&d) == z.support(&r.t().apply(&d)));
        let d = t.draw.direction(n, 3);
        let both = z.support(&d).zip(w.support(&d)).map(|(a, b)| a + b);
        t.check(z.sum(&w).support(&d) == both);
        let meet = z.meet(&r, &y);
        for x in z.points(&mut t.draw, 3) {
            t.check(meet.contains(&x) == y.contains(&r.apply(&x)));
        }
    }
}

/// The vertices of {|ξ| ≤ 1, A ξ = b} with every choice of the basic columns, without a simplex.
fn all_vertices(z: &Cz) -> Vec<V> {
    let (n, m) = (z.a.cols(), z.a.rows());
    let mut out = Vec::new();
    for chosen in 0_u32..1 << n {
        if chosen.count_ones() as usize != m {
            continue;
        }
        let basic: Vec<usize> = (0..n).filter(|j| chosen >> j & 1 == 1).collect();
        let Some(inverse) = M::from_fn(m, m, |i, j| z.a[(i, basic[j])].clone()).inverse() else {
            continue;
        };
        for signs in 0_u32..1 << (n - m) {
            let mut xi = vec![Q::zero(); n];
            let free = (0..n).filter(|j| chosen >> j & 1 == 0);
            for (k, j) in free.enumerate() {
                xi[j] = q(if signs >> k & 1 == 1 { 1 } else { -1 });
            }
            let solved = inverse.apply(&sub(&z.b, &z.a.apply(&xi)));
            if solved.iter().all(|x| x.abs() <= q(1)) {
                for (j, x) in basic.iter().zip(solved) {
                    xi[*j] = x;
                }
                out.push(xi);
            }
        }
    }
    out
}

fn interval_hull(t: &mut Trial) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let rank = z.a.rank();
        if rank < z.a.rows() {
            continue;
        }
        let points: Vec<V> = all_vertices(&z).iter().map(|xi| z.at(xi)).collect();
        let hull = z.hull();
        for i in 0..n {
            let low = points.iter().map(|p| p[i].clone()).min();
            let high = points.iter().map(|p| p[i].clone()).max();
            t.check(hull.as_ref().map(|h| h[i].clone()) == low.zip(high));
        }
    }
}

/// A closest point to h in the 1-norm, and its distance.
pub fn closest(z: &Cz, h: &[Q]) -> Option<(V, Q)> {
    weighted_closest(z, h, &vec![q(1); h.len()])
}

/// A point z of Z that minimises Σ wᵢ |zᵢ − hᵢ|, and that sum.
pub fn weighted_closest(z: &Cz, h: &[Q], weight: &[Q]) -> Option<(V, Q)> {
    let (n, g) = (h.len(), z.g.cols());
    let offset = sub(&z.c, h);
    let far = norm1(&offset) + (0..n).fold(Q::zero(), |s, i| s + norm1(z.g.row(i))) + q(1);
    let mut lower = vec![q(-1); g];
    let mut upper = vec![q(1); g];
    lower.extend(vec![q(0); n]);
    upper.extend(vec![far.clone(); n]);
    let mut lp = Lp::over(lower, upper);
    for i in 0..z.a.rows() {
        let row = [z.a.row(i).to_vec(), vec![q(0); n]].concat();
        lp.equal(&row, &z.b[i]);
    }
    for i in 0..n {
        for sign in [1, -1] {
            // sign (offset + G ξ) − s ≤ 0, and it is at least −2 far.
            let mut row = scale(&q(sign), z.g.row(i));
            row.extend((0..n).map(|j| q(if i == j { -1 } else { 0 })));
            let shift = q(sign) * &offset[i];
            lp.row(row, -q(3) * &far, -shift);
        }
    }
    let mut cost = vec![q(0); g];
    cost.extend(weight.iter().map(|w| -w.clone()));
    let (value, at) = lp.maximize(&cost)?;
    Some((z.at(&at[..g]), -value))
}

fn closest_point(t: &mut Trial) {
    for _ in 0..80 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let h = t.draw.vector(n, 5);
        let Some((point, distance)) = closest(&z, &h) else {
            t.check(false);
            continue;
        };
        t.check(z.contains(&point) && norm1(&sub(&point, &h)) == distance);
        for other in z.points(&mut t.draw, 6) {
            t.check(norm1(&sub(&other, &h)) >= distance);
        }
    }
}

/// The interval [ξ^L, ξ^U] ⊇ [−1, 1] of least width with c + G (ξ^L + ξ^U)/2 = h; `None` if there is none
/// below 1000.
fn recentred(z: &Cz, h: &[Q]) -> Option<(V, V)> {
    let g = z.g.cols();
    let lower = [vec![q(-1000); g], vec![q(1); g]].concat();
    let upper = [vec![q(-1); g], vec![q(1000); g]].concat();
    let mut lp = Lp::over(lower, upper);
    for i in 0..h.len() {
        let half = scale(&frac(1, 2), z.g.row(i));
        lp.equal(&[half.clone(), half].concat(), &(&h[i] - &z.c[i]));
    }
    let cost = [vec![q(1); g], vec![q(-1); g]].concat();
    let (_, at) = lp.maximize(&cost)?;
    Some((at[..g].to_vec(), at[g..].to_vec()))
}

/// (11); without the rows [A E_r, 0] if `short`.
fn with_center(z: &Cz, h: &[Q], short: bool) -> Option<Cz> {
    let (low, high) = recentred(z, h)?;
    let middle = scale(&frac(1, 2), &add(&low, &high));
    let radius = M::diag(&scale(&frac(1, 2), &sub(&high, &low)));
    let (ge, ae) = (z.g.mul(&radius), z.a.mul(&radius));
    let g = z.g.cols();
    let own = ae.beside(&M::zeros(z.a.rows(), g));
    let copy = M::zeros(z.a.rows(), g).beside(&z.a);
    let link = ge.beside(&z.g.scale(&q(-1)));
    let (tail_a, tail_b) = (copy.above(&link), [z.b.clone(), sub(&z.c, h)].concat());
    let (a, b) = if short {
        (tail_a, tail_b)
    } else {
        let head = sub(&z.b, &z.a.apply(&middle));
        (own.above(&tail_a), [head, tail_b].concat())
    };
    Some(Cz {
        g: ge.beside(&M::zeros(z.g.rows(), g)),
        c: h.to_vec(),
        a,
        b,
    })
}

fn change_of_center(t: &mut Trial) {
    for _ in 0..60 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let generators = z.g.cols();
        let h = add(&z.c, &z.g.apply(&t.draw.units(generators)));
        for _ in 0..2 {
            let d = t.draw.direction(n, 3);
            let expected = z.support(&d);
            t.check(with_center(&z, &h, false).map(|z| z.support(&d)) == Some(expected.clone()));
            // The shorter representation, the consequence.
            t.repaired(with_center(&z, &h, true).map(|z| z.support(&d)) == Some(expected));
        }
    }
}

fn range_of_g(t: &mut Trial) {
    let z = Cz::zonotope(M::ints(&[&[1], &[0]]), v(&[0, 1]));
    let h = v(&[1, 0]);
    t.check_or(recentred(&z, &h).is_some(), || {
        format!(
            "G = [1; 0], c = {}, h = {}: no solution",
            text(&z.c),
            text(&h)
        )
    });
    for _ in 0..300 {
        let g = t.draw.matrix(2, 1, 2);
        let z = Cz::zonotope(g.clone(), t.draw.vector(2, 2));
        let h = g.apply(&t.draw.vector(1, 3));
        t.check(recentred(&z, &h).is_some());
        t.repaired(recentred(&z, &add(&z.c, &h)).is_some());
    }
}

fn full_rank(t: &mut Trial) {
    for _ in 0..200 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let h = t.draw.vector(n, 5);
        if z.g.rank() == n {
            t.check(recentred(&z, &h).is_some());
        }
    }
}

fn update(t: &mut Trial) {
    for _ in 0..80 {
        let (n, m) = (t.draw.size(1, 2), t.draw.size(1, 2));
        let (x, noise) = (set(&mut t.draw, n), set(&mut t.draw, m));
        let c = t.draw.matrix(m, n, 2);
        let d = t.draw.matrix(m, m, 1);
        let points = x.points(&mut t.draw, 3);
        let drawn = noise.points(&mut t.draw, 3);
        let Some((truth, error)) = points.first().zip(drawn.first()) else {
            continue;
        };
        let y = add(&c.apply(truth), &d.apply(error));
        let mut consistent = noise.image(&d.scale(&q(-1)));
        consistent.c = add(&y, &consistent.c);
        let meet = x.meet(&c, &consistent);
        t.check(meet.contains(truth));
        for p in &points {
            t.check(meet.contains(p) == consistent.contains(&c.apply(p)));
        }
        t.check(
            meet.g.cols() == x.g.cols() + noise.g.cols()
                && meet.a.rows() == x.a.rows() + noise.a.rows() + m,
        );
        let direction = t.draw.direction(n, 3);
        let best = meet.maximize(&direction);
        t.check(best.is_some_and(|(value, xi)| {
            let p = meet.at(&xi);
            dot(&direction, &p) == value && x.contains(&p) && consistent.contains(&c.apply(&p))
        }));
    }
}
