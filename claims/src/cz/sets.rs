//! Section 3: set operations, the closest point, the change of centre.

use super::claim;
use crate::exact::{Cz, Lp, M, Q, Source, V, add, dot, frac, norm1, q, scale, sub, text, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "section-3.1-parallelotopes",
            "Using ellipsoids or parallelotopes, the linear mapping (4) can be computed exactly",
            "ellipsoids for every R, parallelotopes for injective R alone; nothing of the paper rests on it",
            |t| parallelotopes(t, false),
        )
        .twin("R that is not injective", |t| parallelotopes(t, true)),
        claim(
            "equations-8-10",
            "(8)-(10) are the image, the Minkowski sum and the generalized intersection",
            "",
            |t| operations(t, false),
        )
        .twin("c_y in place of c_y - R c_z", |t| operations(t, true)),
        claim(
            "property-1",
            "2n linear programs give the interval hull",
            "",
            |t| interval_hull(t, false),
        )
        .twin("the constraints left out", |t| interval_hull(t, true)),
        claim(
            "proposition-1",
            "the linear program gives a point of Z that is closest to h in the 1-norm",
            "",
            |t| closest_point(t, false),
        )
        .twin("the constraints left out", |t| closest_point(t, true)),
        claim(
            "proposition-2",
            "(11) is an equivalent CG-rep of Z with center h, for any h",
            "the rows [A E_r, 0] are redundant: n_c + n constraints suffice",
            |t| change_of_center(t, false),
        )
        .twin("E_r halved", |t| change_of_center(t, true)),
        claim(
            "proposition-2-range",
            "the linear program of Proposition 2 is feasible for h in the range of G (Remark 1)",
            "a slip: the constraint beside it shows that h - c must be in the range of G",
            |t| range_of_g(t, false),
        )
        .class(Class::Slip)
        .twin("h - c outside of the range", |t| range_of_g(t, true)),
        claim(
            "remark-1",
            "the linear program is feasible for all h if G is full row rank",
            "",
            |t| full_rank(t, false),
        )
        .twin("G of any rank", |t| full_rank(t, true)),
        claim(
            "footnote-5",
            "the center of the hull of the polytope of (0,0,0), (1,1,0), (0,1,0), (0,1,1) is not in it",
            "C1 has to be checked",
            |t| hull_center(t, false),
        )
        .twin("the mean of the vertices", |t| hull_center(t, true)),
        claim(
            "equation-22",
            "(22) is exact, with n_g + n_gv generators and n_c + n_cv + n_y constraints",
            "",
            |t| update(t, false),
        )
        .twin("D_v V in place of -D_v V", |t| update(t, true)),
    ]
}

/// Whether c + G [−1, 1]^k is a parallelotope: of its generators, parallel ones counted once, none is a combination of
/// others.
fn is_parallelotope(g: &M) -> bool {
    let columns: Vec<V> = (0..g.cols())
        .map(|j| g.col(j))
        .filter(|c| c.iter().any(|x| !x.is_zero()))
        .collect();
    let pair = |a: &V, b: &V| M::of_rows(a.len(), &[a.clone(), b.clone()]).rank();
    let directions = (0..columns.len())
        .filter(|&j| (0..j).all(|i| pair(&columns[i], &columns[j]) == 2))
        .count();
    directions == g.rank()
}

fn parallelotopes(t: &mut Trial, damaged: bool) {
    let cube = [&[1, 0, 1][..], &[0, 1, 1], &[0, 0, 0]];
    for rows in [&cube[..2], &cube[..]] {
        let r = M::ints(rows);
        t.check_or(is_parallelotope(&r), || {
            format!(
                "R = {} maps the cube [-1,1]^3 to a hexagon, and so does [1 0 1; 0 1 1; 0 0 0]",
                r.text()
            )
        });
    }
    for _ in 0..300 {
        let g = t.draw.matrix(3, 3, 2);
        if g.rank() < 3 {
            continue;
        }
        let r = t.draw.matrix(2, 3, 2);
        t.check(is_parallelotope(&r.mul(&g)));
        let rows = t.draw.size(3, 4);
        let r = t.draw.matrix(rows, 3, if damaged { 1 } else { 2 });
        if damaged || r.rank() == 3 {
            t.repaired(is_parallelotope(&r.mul(&g)));
        }
    }
}

fn set(draw: &mut Source, n: usize) -> Cz {
    let constraints = draw.size(0, 1);
    let generators = draw.size(n, n + 1) + constraints;
    draw.cz(n, generators, constraints)
}

fn operations(t: &mut Trial, damaged: bool) {
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
        let mut meet = z.meet(&r, &y);
        if damaged {
            let last = meet.b.len() - m;
            meet.b.splice(last.., y.c.clone());
        }
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

fn interval_hull(t: &mut Trial, damaged: bool) {
    for _ in 0..150 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let rank = z.a.rank();
        if rank < z.a.rows() {
            continue;
        }
        let points: Vec<V> = all_vertices(&z).iter().map(|xi| z.at(xi)).collect();
        let hull = if damaged {
            z.relaxed().hull()
        } else {
            z.hull()
        };
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

fn closest_point(t: &mut Trial, damaged: bool) {
    for _ in 0..80 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let h = t.draw.vector(n, 5);
        let over = if damaged { z.relaxed() } else { z.clone() };
        let Some((point, distance)) = closest(&over, &h) else {
            t.check(false);
            continue;
        };
        t.check(z.contains(&point) && norm1(&sub(&point, &h)) == distance);
        for other in z.points(&mut t.draw, 6) {
            t.check(norm1(&sub(&other, &h)) >= distance);
        }
    }
}

/// The interval [ξ^L, ξ^U] ⊇ [ξ̃^L, ξ̃^U] of least width with c + G (ξ^L + ξ^U)/2 = h; `None` if there is none
/// below 1000.
fn recentred_within(z: &Cz, h: &[Q], (low, high): (&[Q], &[Q])) -> Option<(V, V)> {
    let g = z.g.cols();
    let lower = [vec![q(-1000); g], high.to_vec()].concat();
    let upper = [low.to_vec(), vec![q(1000); g]].concat();
    let mut lp = Lp::over(lower, upper);
    for i in 0..h.len() {
        let half = scale(&frac(1, 2), z.g.row(i));
        lp.equal(&[half.clone(), half].concat(), &(&h[i] - &z.c[i]));
    }
    let cost = [vec![q(1); g], vec![q(-1); g]].concat();
    let (_, at) = lp.maximize(&cost)?;
    Some((at[..g].to_vec(), at[g..].to_vec()))
}

/// The same about the whole cube.
fn recentred(z: &Cz, h: &[Q]) -> Option<(V, V)> {
    let g = z.g.cols();
    recentred_within(z, h, (&vec![q(-1); g], &vec![q(1); g]))
}

/// (11) from ξ^L and ξ^U; without the rows [A E_r, 0] if `short`, and with a share of E_r.
fn with_center(z: &Cz, h: &[Q], (low, high): &(V, V), short: bool, share: &Q) -> Cz {
    let middle = scale(&frac(1, 2), &add(low, high));
    let radius = M::diag(&scale(&(share / q(2)), &sub(high, low)));
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
    Cz {
        g: ge.beside(&M::zeros(z.g.rows(), g)),
        c: h.to_vec(),
        a,
        b,
    }
}

/// h in Z's cube and far from it, the bounds of ξ by the whole cube and by linear programs.
fn change_of_center(t: &mut Trial, damaged: bool) {
    let share = frac(1, if damaged { 2 } else { 1 });
    for k in 0..60 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let generators = z.g.cols();
        let far = q(if k % 2 == 0 { 1 } else { 4 });
        let xi = scale(&far, &t.draw.units(generators));
        let h = z.at(&xi);
        let own = Cz {
            g: M::identity(generators),
            c: vec![Q::zero(); generators],
            ..z.clone()
        };
        let tight: (V, V) = own.hull().unwrap_or_default().into_iter().unzip();
        let whole = recentred(&z, &h);
        for ends in [whole, recentred_within(&z, &h, (&tight.0, &tight.1))] {
            let Some(ends) = ends else {
                t.check(false);
                continue;
            };
            let d = t.draw.direction(n, 3);
            let expected = z.support(&d);
            t.check(with_center(&z, &h, &ends, false, &share).support(&d) == expected);
            // The shorter representation, the consequence.
            t.repaired(with_center(&z, &h, &ends, true, &q(1)).support(&d) == expected);
        }
    }
}

fn range_of_g(t: &mut Trial, damaged: bool) {
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
        let moved = if damaged { t.draw.vector(2, 3) } else { h };
        t.repaired(recentred(&z, &add(&z.c, &moved)).is_some());
    }
}

fn full_rank(t: &mut Trial, damaged: bool) {
    for _ in 0..200 {
        let n = t.draw.size(1, 2);
        let z = set(&mut t.draw, n);
        let h = t.draw.vector(n, 5);
        if damaged || z.g.rank() == n {
            t.check(recentred(&z, &h).is_some());
        }
    }
}

/// The convex hull of these points: Σ λ_k v_k, λ_k = (1 + ξ_k)/2, Σ λ_k = 1.
fn convex_hull(points: &[V]) -> Cz {
    let (n, k) = (points[0].len(), points.len());
    let half = frac(1, 2);
    let center = points.iter().fold(vec![Q::zero(); n], |s, p| add(&s, p));
    Cz {
        g: M::from_fn(n, k, |i, j| &points[j][i] * &half),
        c: scale(&half, &center),
        a: M::from_fn(1, k, |_, _| q(1)),
        b: vec![q(2 - k as i64)],
    }
}

fn hull_center(t: &mut Trial, damaged: bool) {
    let points = [v(&[0, 0, 0]), v(&[1, 1, 0]), v(&[0, 1, 0]), v(&[0, 1, 1])];
    let z = convex_hull(&points);
    let hull = z.hull().unwrap_or_default();
    let middle: V = hull.iter().map(|(l, h)| (l + h) / q(2)).collect();
    let mean = scale(
        &frac(1, 4),
        &points.iter().fold(v(&[0, 0, 0]), |s, p| add(&s, p)),
    );
    t.check(points.iter().all(|p| z.contains(p)));
    t.check(!z.contains(if damaged { &mean } else { &middle }));
}

fn update(t: &mut Trial, damaged: bool) {
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
        let mut used = noise.image(&d.scale(&q(if damaged { 1 } else { -1 })));
        used.c = add(&y, &used.c);
        let meet = x.meet(&c, &used);
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
