//! The claims of \[MeslemRamdani\]: the estimator of boxes beside the Kalman filter.

use crate::exact::{M, Q, Source, V, add, frac, q, scale, sub, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "section-II-ellipsoid",
            "the Kalman equations generate a gradually smaller confidence ellipsoid",
            "it is smaller at every step once it is smaller at one; in the paper's own example trace and area fall at every step",
            |t| kalman(t, false),
        )
        .twin("the first step need not be smaller", |t| kalman(t, true)),
        claim(
            "equation-5",
            "(5) bounds A x over a box (Remark 1: in the lines 1, 5, 7 and 11)",
            "the bounds are the interval hull",
            |t| product_of_a_box(t, true),
        )
        .twin("A^- left out", |t| product_of_a_box(t, false)),
        claim(
            "proposition-1",
            "Box-State-Est is a set-membership state estimator (1_n^k [d] is the stack of k boxes)",
            "",
            |t| estimator_of_stacks(t, Lines::whole()),
        )
        .twin("O_d [d] left out of line 5", |t| {
            estimator_of_stacks(t, Lines { od: false, ..Lines::whole() })
        })
        .twin("M_2 [d] left out of line 7", |t| {
            estimator_of_stacks(t, Lines { m2: false, ..Lines::whole() })
        })
        .twin("[d] left out of line 11", |t| {
            estimator_of_stacks(t, Lines { line_11: false, ..Lines::whole() })
        })
        .twin("half of [v]", |t| {
            estimator_of_stacks(t, Lines { v: frac(1, 2), ..Lines::whole() })
        }),
        claim(
            "proposition-1-matrix-first",
            "(a reading that the paper does not ask for) N_k 1_n^k, O_d 1_n^(n-1) and M_2 1_n^(n-1) are multiplied first",
            "that assumes a constant d: stack the boxes, then one product",
            |t| estimator_of_matrices(t, Lines::whole()),
        )
        .class(Class::Remark)
        .twin("the stacked algorithm with half of [v]", |t| {
            estimator_of_matrices(t, Lines { v: frac(1, 2), ..Lines::whole() })
        }),
        claim(
            "equation-17",
            "the width of [x_k] is at most beta_v W([v]) + beta_d W([d]) after n - 1 iterations",
            "inside the norms the signs of O* cancel. True of the algorithm: | |M1| |O*| H | W([v]) + | |M2| 1 + |M1| |O*| |O_d| 1 | W([d]). \
             With every matrix product formed first, O* H and O* O_d 1 too, (17) as printed is a bound of the widths, but then the \
             boxes do not contain the state",
            |t| width(t, true),
        )
        .twin("|M2| 1 left out of the corrected bound", |t| width(t, false)),
        claim(
            "remark-2",
            "no error amplification is induced by an output injection: without a gain the widths do not build up from step to step",
            "after n - 1 steps a width is bounded by [v] and [d] alone, whatever came before",
            without_injection,
        )
        .twin("an interval observer with the gain A C' (C C')^-1 in place of the inversion", with_injection),
        claim(
            "remark-2-inversion",
            "(a remark of ours) the inversion of O amplifies the noise",
            "x2 is a difference of measurements: warn on the condition number of O",
            |t| amplification(t, q(1)),
        )
        .class(Class::Remark)
        .twin("half of what | |M1| |O*| H | allows", |t| amplification(t, frac(1, 2))),
        claim(
            "section-IV-observable",
            "the pair (A, C) of (18) is observable",
            "",
            |t| observable(t, &[&[-22, 1]]),
        )
        .twin("C = [0 1]", |t| observable(t, &[&[0, 1]])),
    ]
}

fn claim(
    id: &'static str,
    statement: &'static str,
    consequence: &'static str,
    run: fn(&mut Trial),
) -> Claim {
    Claim {
        paper: "box",
        id,
        statement,
        consequence,
        class: Class::Stated,
        run,
        twins: Vec::new(),
    }
}

/// A box by centre and half widths.
#[derive(Clone, Debug, PartialEq)]
struct Area {
    c: V,
    r: V,
}

impl Area {
    /// (5).
    fn times(&self, m: &M) -> Area {
        Area {
            c: m.apply(&self.c),
            r: m.abs().apply(&self.r),
        }
    }

    fn plus(&self, other: &Area) -> Area {
        Area {
            c: add(&self.c, &other.c),
            r: add(&self.r, &other.r),
        }
    }

    fn minus(&self, other: &Area) -> Area {
        Area {
            c: sub(&self.c, &other.c),
            r: add(&self.r, &other.r),
        }
    }

    fn stack(&self, k: usize) -> Area {
        Area {
            c: vec![self.c.clone(); k].concat(),
            r: vec![self.r.clone(); k].concat(),
        }
    }

    fn contains(&self, x: &[Q]) -> bool {
        sub(x, &self.c)
            .iter()
            .zip(&self.r)
            .all(|(d, r)| d.abs() <= *r)
    }

    /// The intersection; `None` if it is empty.
    fn meet(&self, other: &Area) -> Option<Area> {
        let (mut c, mut r) = (Vec::new(), Vec::new());
        for i in 0..self.c.len() {
            let low = (&self.c[i] - &self.r[i]).max(&other.c[i] - &other.r[i]);
            let high = (&self.c[i] + &self.r[i]).min(&other.c[i] + &other.r[i]);
            if low > high {
                return None;
            }
            c.push((&low + &high) / q(2));
            r.push((high - low) / q(2));
        }
        Some(Area { c, r })
    }
}

/// (5) against the corners of the box.
fn product_of_a_box(t: &mut Trial, whole: bool) {
    for _ in 0..300 {
        let (m, n) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let a = t.draw.matrix(m, n, 3);
        let low = t.draw.vector(n, 3);
        let high: V = low.iter().map(|l| l + q(t.draw.int(0, 4))).collect();
        let plus = M::from_fn(m, n, |i, j| a[(i, j)].clone().max(Q::zero()));
        let minus = plus.sub(&a).scale(&q(i64::from(whole)));
        let below = sub(&plus.apply(&low), &minus.apply(&high));
        let above = sub(&plus.apply(&high), &minus.apply(&low));
        let corners: Vec<V> = (0..1_usize << n)
            .map(|bits| {
                let corner = (0..n).map(|j| {
                    if bits >> j & 1 == 1 {
                        &high[j]
                    } else {
                        &low[j]
                    }
                });
                a.apply(&corner.cloned().collect::<V>())
            })
            .collect();
        for i in 0..m {
            let values = || corners.iter().map(|x| x[i].clone());
            t.check(values().min() == Some(below[i].clone()));
            t.check(values().max() == Some(above[i].clone()));
        }
    }
}

/// A system x⁺ = A x + d, y = C x + v without inputs.
struct System {
    a: M,
    c: M,
}

/// The matrices of the inversion over n steps.
struct Inversion {
    /// A left inverse (OᵀO)⁻¹Oᵀ of the observability matrix.
    left: M,
    /// O_d.
    od: M,
    /// A^(n−1).
    m1: M,
    /// [I A … A^(n−2)].
    m2: M,
}

impl System {
    /// Observable, of 2 or 3 states.
    fn drawn(draw: &mut Source) -> (System, Inversion) {
        loop {
            let n = draw.size(2, 3);
            let ny = draw.size(1, 2);
            let system = System {
                a: draw.matrix(n, n, 1),
                c: draw.matrix(ny, n, 2),
            };
            if let Some(inversion) = system.inversion() {
                return (system, inversion);
            }
        }
    }

    fn powers(&self, count: usize) -> Vec<M> {
        let mut all = vec![M::identity(self.a.rows())];
        while all.len() < count {
            let next = self.a.mul(&all[all.len() - 1]);
            all.push(next);
        }
        all
    }

    /// `None` if the system is not observable.
    fn inversion(&self) -> Option<Inversion> {
        let (n, ny) = (self.a.rows(), self.c.rows());
        let power = self.powers(n);
        let o = (1..n).fold(self.c.clone(), |o, i| o.above(&self.c.mul(&power[i])));
        let left = o.t().mul(&o).inverse()?.mul(&o.t());
        let blocks: Vec<M> = power.iter().map(|p| self.c.mul(p)).collect();
        let od = M::from_fn(n * ny, n * (n - 1), |row, col| {
            let (i, c) = (row / ny, col / n);
            if c < i {
                blocks[i - 1 - c][(row % ny, col % n)].clone()
            } else {
                Q::zero()
            }
        });
        let m2 = self.side_by_side(n - 1);
        Some(Inversion {
            left,
            od,
            m1: power[n - 1].clone(),
            m2,
        })
    }

    /// [I A … A^(k−1)].
    fn side_by_side(&self, k: usize) -> M {
        let power = self.powers(k);
        power[1..]
            .iter()
            .fold(power[0].clone(), |all, p| all.beside(p))
    }
}

/// M 1ᵏ [d]: M times the stack, or the product M 1ᵏ first.
fn spread(m: &M, d: &Area, first: bool) -> Area {
    let n = d.c.len();
    let k = m.cols() / n;
    if !first {
        return d.stack(k).times(m);
    }
    let sum = M::from_fn(m.rows(), n, |i, j| {
        (0..k).fold(Q::zero(), |s, b| s + &m[(i, b * n + j)])
    });
    d.times(&sum)
}

/// The parts of the algorithm, of which a damaged twin lacks one.
#[derive(Clone)]
struct Lines {
    /// O_d 1ⁿ⁻¹ [d] in line 5.
    od: bool,
    /// M_2 1ⁿ⁻¹ [d] in line 7.
    m2: bool,
    /// [d] in line 11.
    line_11: bool,
    /// The part of [v] in (16).
    v: Q,
}

impl Lines {
    /// The algorithm as it is.
    fn whole() -> Self {
        Self {
            od: true,
            m2: true,
            line_11: true,
            v: q(1),
        }
    }
}

/// A product of the algorithm, or nothing where the twin lacks it.
fn part(there: bool, a: Area) -> Area {
    let f = q(i64::from(there));
    Area {
        c: scale(&f, &a.c),
        r: scale(&f, &a.r),
    }
}

/// The boxes [x_k], k = n − 1 …, or `None` once the truth is lost.
fn boxes(
    system: &System,
    x0: &Area,
    d: &Area,
    y: &[V],
    truth: &[V],
    first: bool,
    lines: &Lines,
) -> Option<Vec<Area>> {
    let n = system.a.rows();
    let inv = system.inversion()?;
    let v_box = Area {
        c: vec![Q::zero(); system.c.rows()],
        r: vec![lines.v.clone(); system.c.rows()],
    };
    let power = system.powers(n);
    let mut predicted = vec![x0.clone()];
    for k in 1..n {
        let far = spread(&system.side_by_side(k), d, first);
        predicted.push(x0.times(&power[k]).plus(&far));
    }
    if (0..n - 1).any(|k| !predicted[k].contains(&truth[k])) {
        return None;
    }
    let mut out = Vec::new();
    for k in n - 1..truth.len() {
        let j = k - (n - 1);
        let stacked = Area {
            c: y[j..=k].concat(),
            r: vec![Q::zero(); n * system.c.rows()],
        };
        let right = stacked
            .minus(&v_box.stack(n))
            .minus(&part(lines.od, spread(&inv.od, d, first)));
        let past = right.times(&inv.left).meet(&predicted[j])?;
        let now = past
            .times(&inv.m1)
            .plus(&part(lines.m2, spread(&inv.m2, d, first)));
        let own = now.meet(&predicted[k]).filter(|b| b.contains(&truth[k]))?;
        predicted.push(own.times(&system.a).plus(&part(lines.line_11, d.clone())));
        out.push(own);
    }
    Some(out)
}

/// A run: its system, x_0 and the boxes of x_0 and d, measurements and states.
struct Run {
    system: System,
    x0: Area,
    d: Area,
    y: Vec<V>,
    truth: Vec<V>,
}

/// A run of `steps` steps beyond n with noise at the corners of its boxes.
fn run(t: &mut Trial, steps: usize) -> Run {
    let (system, _) = System::drawn(&mut t.draw);
    let (n, ny) = (system.a.rows(), system.c.rows());
    let d = Area {
        c: vec![Q::zero(); n],
        r: vec![frac(1, 2); n],
    };
    let x0 = Area {
        c: vec![Q::zero(); n],
        r: vec![q(2); n],
    };
    let mut x: V = t.draw.units(n).iter().map(|u| u * q(2)).collect();
    let (mut truth, mut y) = (Vec::new(), Vec::new());
    for _ in 0..n + steps {
        let noise: V = (0..ny).map(|_| t.draw.sign()).collect();
        y.push(add(&system.c.apply(&x), &noise));
        truth.push(x.clone());
        let push: V = (0..n).map(|_| t.draw.sign() / q(2)).collect();
        x = add(&system.a.apply(&x), &push);
    }
    Run {
        system,
        x0,
        d,
        y,
        truth,
    }
}

impl Run {
    fn boxes(&self, first: bool, lines: &Lines) -> Option<Vec<Area>> {
        boxes(
            &self.system,
            &self.x0,
            &self.d,
            &self.y,
            &self.truth,
            first,
            lines,
        )
    }
}

fn estimator_of_stacks(t: &mut Trial, lines: Lines) {
    for _ in 0..120 {
        let holds = run(t, 3).boxes(false, &lines).is_some();
        t.check(holds);
    }
}

fn estimator_of_matrices(t: &mut Trial, stacked: Lines) {
    // n = 3, A = −I, x0 = 0: x2 = A d0 + d1, and (I + A)[d] = 0.
    let system = System {
        a: M::identity(3).scale(&q(-1)),
        c: M::identity(3),
    };
    let d = Area {
        c: v(&[0, 0, 0]),
        r: v(&[1, 1, 1]),
    };
    let printed = spread(&system.side_by_side(2), &d, true);
    let truth = add(&system.a.apply(&v(&[-1, 0, 0])), &v(&[1, 0, 0]));
    t.check_or(printed.contains(&truth), || {
        format!(
            "n = 3, A = -I, C = I, [x0] = {{0}}, [d] = [-1, 1]^3: (I + A)[d] = [-{0}, {0}], d0 = (-1, 0, 0), d1 = (1, 0, 0) \
             give x1 = {1}",
            printed.r[0], truth[0]
        )
    });
    for _ in 0..120 {
        let run = run(t, 3);
        t.check(run.boxes(true, &Lines::whole()).is_some());
        t.repaired(run.boxes(false, &stacked).is_some());
    }
}

/// The largest row sum of |entries|.
fn norm(m: &M) -> Q {
    m.row_sums().into_iter().max().unwrap_or_else(Q::zero)
}

/// Half widths of [x_k]_c, which do not depend on the data: those of [x_k] if the prior is wide.
fn half_widths(system: &System, inv: &Inversion, d: &Q, v: &Q) -> V {
    let (n, ny) = (system.a.rows(), system.c.rows());
    let d = vec![d.clone(); n * (n - 1)];
    let right = add(&vec![v.clone(); n * ny], &inv.od.abs().apply(&d));
    let past = inv.left.abs().apply(&right);
    add(&inv.m1.abs().apply(&past), &inv.m2.abs().apply(&d))
}

/// β_v and β_d, printed and corrected.
fn factors(system: &System, inv: &Inversion) -> [(Q, Q); 2] {
    let (n, ny) = (system.a.rows(), system.c.rows());
    let ones = |size: usize| {
        let unit = M::identity(size);
        move |k: usize| (1..k).fold(unit.clone(), |all, _| all.above(&unit))
    };
    let (h, d) = (ones(ny)(n), ones(n)(n - 1));
    let printed = (
        norm(&inv.m1) * norm(&inv.left.mul(&h)),
        norm(&inv.m2.mul(&d)) + norm(&inv.m1) * norm(&inv.left.mul(&inv.od).mul(&d)),
    );
    let through = inv.m1.abs().mul(&inv.left.abs());
    let corrected = (
        norm(&through.mul(&h)),
        norm(
            &inv.m2
                .abs()
                .mul(&d)
                .add(&through.mul(&inv.od.abs()).mul(&d)),
        ),
    );
    [printed, corrected]
}

/// Half widths of [x_k]_c with every product of matrices formed first: O* H, O* O_d 1ⁿ⁻¹ and M_2 1ⁿ⁻¹.
fn half_widths_first(system: &System, inv: &Inversion, d: &Q, v: &Q) -> V {
    let (n, ny) = (system.a.rows(), system.c.rows());
    let stack = |size: usize, k: usize| {
        (1..k).fold(M::identity(size), |all, _| all.above(&M::identity(size)))
    };
    let (d, v) = (vec![d.clone(); n], vec![v.clone(); ny]);
    let past = add(
        &inv.left.mul(&stack(ny, n)).abs().apply(&v),
        &inv.left.mul(&inv.od).mul(&stack(n, n - 1)).abs().apply(&d),
    );
    add(
        &inv.m1.abs().apply(&past),
        &inv.m2.mul(&stack(n, n - 1)).abs().apply(&d),
    )
}

fn largest(half: V) -> Q {
    half.into_iter().max().unwrap_or_else(Q::zero) * q(2)
}

fn width(t: &mut Trial, whole: bool) {
    let system = System {
        a: M::of_rows(2, &[vec![q(1), frac(1, 10)], v(&[0, 1])]),
        c: M::ints(&[&[1, 0]]),
    };
    if let Some(inv) = system.inversion() {
        let [printed, _] = factors(&system, &inv);
        let (bound, own) = (
            printed.0 * q(2),
            largest(half_widths(&system, &inv, &q(0), &q(1))),
        );
        t.check_or(own <= bound, || {
            format!(
                "A = [1 1/10; 0 1], C = [1 0], d = 0, v in [-1, 1], wide x0: (17) gives {bound}, the width is {own}"
            )
        });
    }
    for _ in 0..400 {
        let (system, inv) = System::drawn(&mut t.draw);
        let (d, v) = (q(t.draw.int(0, 3)), q(t.draw.int(1, 3)));
        let own = largest(half_widths(&system, &inv, &d, &v));
        let [printed, mut corrected] = factors(&system, &inv);
        let bound = |(bv, bd): &(Q, Q)| (bv * &v + bd * &d) * q(2);
        t.check(own <= bound(&printed));
        if !whole {
            let n = system.a.rows();
            let d = vec![q(1); n * (n - 1)];
            corrected.1 -= inv
                .m2
                .abs()
                .apply(&d)
                .into_iter()
                .max()
                .unwrap_or_else(Q::zero);
        }
        t.repaired(own <= bound(&corrected));
        t.repaired(largest(half_widths_first(&system, &inv, &d, &v)) <= bound(&printed));
    }
}

/// Runs of 12 steps: no width is beyond what [v] and [d] of one window give.
fn without_injection(t: &mut Trial) {
    for _ in 0..60 {
        let run = run(t, 12);
        let Some(inv) = run.system.inversion() else {
            continue;
        };
        let bound = half_widths(&run.system, &inv, &frac(1, 2), &q(1));
        let boxes = run.boxes(false, &Lines::whole());
        t.check(boxes.is_some_and(|all| {
            all.iter()
                .all(|b| b.r.iter().zip(&bound).all(|(r, bound)| r <= bound))
        }));
    }
}

/// The same runs followed by x⁺ ∈ (A − L C)[x] + L (y − [v]) + [d].
fn with_injection(t: &mut Trial) {
    for _ in 0..60 {
        let run = run(t, 12);
        let (a, c) = (&run.system.a, &run.system.c);
        let Some((inv, square)) = run.system.inversion().zip(c.mul(&c.t()).inverse()) else {
            continue;
        };
        let bound = half_widths(&run.system, &inv, &frac(1, 2), &q(1));
        let l = a.mul(&c.t()).mul(&square);
        let rest = a.sub(&l.mul(c)).abs();
        let noise = add(&l.abs().apply(&vec![q(1); c.rows()]), &run.d.r);
        let mut r = run.x0.r.clone();
        for _ in 0..run.y.len() {
            r = add(&rest.apply(&r), &noise);
        }
        t.check(r.iter().zip(&bound).all(|(r, bound)| r <= bound));
    }
}

/// `part` of what the corrected bound allows v.
fn amplification(t: &mut Trial, part: Q) {
    let system = System {
        a: M::of_rows(2, &[vec![q(1), frac(1, 1000)], v(&[0, 1])]),
        c: M::ints(&[&[1, 0]]),
    };
    if let Some(inv) = system.inversion() {
        let own = half_widths(&system, &inv, &q(0), &q(1));
        t.check_or(own[1] <= q(1), || {
            format!(
                "A = [1 1/1000; 0 1], C = [1 0], d = 0: the width of x2 is {} W([v])",
                own[1]
            )
        });
    }
    for _ in 0..300 {
        let (system, inv) = System::drawn(&mut t.draw);
        let own = half_widths(&system, &inv, &q(0), &q(1));
        t.check(own.iter().all(|w| *w <= q(1)));
        let [_, corrected] = factors(&system, &inv);
        t.repaired(largest(own) <= corrected.0 * &part * q(2));
    }
}

/// (18), with another C in the twin.
fn observable(t: &mut Trial, c: &[&[i64]]) {
    let system = System {
        a: example(),
        c: M::ints(c),
    };
    let o = system.c.above(&system.c.mul(&system.a));
    t.check_or(o.rank() == 2, || {
        format!("O = {} has the rank {}", o.text(), o.rank())
    });
}

/// A of (18).
fn example() -> M {
    M::of_rows(2, &[vec![frac(9, 10), q(1)], vec![q(0), frac(4, 5)]])
}

/// One step of the predicted variance of a scalar system.
fn variance(a: &Q, c: &Q, gd: &Q, gv: &Q, p: &Q) -> Q {
    a * a * (p - p * p * c * c / (c * c * p + gv)) + gd
}

/// One step of the predicted covariance of (18) under Table I.
fn covariance(g: &M) -> M {
    let (a, c) = (example(), M::ints(&[&[-22, 1]]));
    let noise = frac(12, 100);
    let image = g.mul(&c.t());
    let s = c.mul(&image)[(0, 0)].clone() + &noise;
    let rest = g.sub(&image.mul(&image.t()).scale(&s.recip()));
    a.mul(&rest).mul(&a.t()).add(&M::identity(2).scale(&noise))
}

fn kalman(t: &mut Trial, any_start: bool) {
    let one = q(1);
    let first = variance(&one, &one, &one, &one, &frac(1, 2));
    let second = variance(&one, &one, &one, &one, &first);
    t.check_or(first <= frac(1, 2), || {
        format!("n = A = C = G_d = G_v = 1, G_0 = 1/2: the variance goes from 1/2 to {first} and {second}")
    });
    for _ in 0..300 {
        let a = frac(t.draw.int(-4, 4), 2);
        let c = q(t.draw.int(-2, 2));
        let (gd, gv) = (q(t.draw.int(0, 3)), q(t.draw.int(1, 3)));
        let mut p = vec![q(t.draw.int(1, 6))];
        for k in 0..4 {
            let next = variance(&a, &c, &gd, &gv, &p[k]);
            p.push(next);
        }
        let smaller = p.windows(2).all(|w| w[1] <= w[0]);
        t.check(smaller);
        if any_start || p[1] <= p[0] {
            t.repaired(smaller);
        }
    }
    // The paper's example: trace and area of the ellipsoid fall at every step.
    let area = |g: &M| &g[(0, 0)] * &g[(1, 1)] - &g[(0, 1)] * &g[(1, 0)];
    let mut g = M::identity(2).scale(&q(10));
    for _ in 0..20 {
        let next = covariance(&g);
        t.repaired(next.trace() < g.trace() && area(&next) < area(&g));
        g = next;
    }
}
