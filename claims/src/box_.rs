//! The claims of \[MeslemRamdani\]: the estimator of boxes beside the Kalman filter.

use crate::exact::{M, Q, Source, V, add, frac, q, sub, v};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

/// The claims, in the order of the text.
pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "section-II-ellipsoid",
            "the Kalman equations generate a gradually smaller confidence ellipsoid",
            "only if the first step is smaller already",
            kalman,
        ),
        claim(
            "equation-5",
            "(5) bounds A x over a box (Remark 1: in the lines 1, 5, 7 and 11)",
            "the bounds are the interval hull",
            product_of_a_box,
        ),
        claim(
            "proposition-1",
            "Box-State-Est is a set-membership state estimator (1_n^k [d] is the stack of k boxes)",
            "",
            estimator_of_stacks,
        ),
        claim(
            "proposition-1-matrix-first",
            "the same with N_k 1_n^k, O_d 1_n^(n-1) and M_2 1_n^(n-1) multiplied first, as printed",
            "that assumes a constant d: stack the boxes, then one product",
            estimator_of_matrices,
        ),
        claim(
            "equation-17",
            "the width of [x_k] is at most beta_v W([v]) + beta_d W([d]) after n - 1 iterations",
            "signs cancel inside the norms; corrected: | |M1| |O*| H | W([v]) + | |M2| 1 + |M1| |O*| |O_d| 1 | W([d])",
            width,
        ),
        claim(
            "remark-2",
            "no observer gain is used, so that any error amplification is avoided",
            "the inversion of O amplifies instead: warn on its condition number",
            amplification,
        ),
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
fn product_of_a_box(t: &mut Trial) {
    for _ in 0..300 {
        let (m, n) = (t.draw.size(1, 3), t.draw.size(1, 3));
        let a = t.draw.matrix(m, n, 3);
        let low = t.draw.vector(n, 3);
        let high: V = low.iter().map(|l| l + q(t.draw.int(0, 4))).collect();
        let plus = M::from_fn(m, n, |i, j| a[(i, j)].clone().max(Q::zero()));
        let minus = plus.sub(&a);
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

/// Whether the estimator keeps the truth in its boxes over the whole run.
fn kept(system: &System, x0: &Area, d: &Area, y: &[V], truth: &[V], first: bool) -> bool {
    let n = system.a.rows();
    let Some(inv) = system.inversion() else {
        return true;
    };
    let v_box = Area {
        c: vec![Q::zero(); system.c.rows()],
        r: vec![q(1); system.c.rows()],
    };
    let power = system.powers(n);
    let mut predicted = vec![x0.clone()];
    for k in 1..n {
        let far = spread(&system.side_by_side(k), d, first);
        predicted.push(x0.times(&power[k]).plus(&far));
    }
    if (0..n - 1).any(|k| !predicted[k].contains(&truth[k])) {
        return false;
    }
    for k in n - 1..truth.len() {
        let j = k - (n - 1);
        let stacked = Area {
            c: y[j..=k].concat(),
            r: vec![Q::zero(); n * system.c.rows()],
        };
        let right = stacked
            .minus(&v_box.stack(n))
            .minus(&spread(&inv.od, d, first));
        let Some(past) = right.times(&inv.left).meet(&predicted[j]) else {
            return false;
        };
        let now = past.times(&inv.m1).plus(&spread(&inv.m2, d, first));
        let Some(own) = now.meet(&predicted[k]).filter(|b| b.contains(&truth[k])) else {
            return false;
        };
        predicted.push(own.times(&system.a).plus(d));
    }
    true
}

/// A run with noise at the corners of its boxes.
fn run(t: &mut Trial, first: bool) -> bool {
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
    for _ in 0..n + 3 {
        let noise: V = (0..ny).map(|_| t.draw.sign()).collect();
        y.push(add(&system.c.apply(&x), &noise));
        truth.push(x.clone());
        let push: V = (0..n).map(|_| t.draw.sign() / q(2)).collect();
        x = add(&system.a.apply(&x), &push);
    }
    kept(&system, &x0, &d, &y, &truth, first)
}

fn estimator_of_stacks(t: &mut Trial) {
    for _ in 0..120 {
        let holds = run(t, false);
        t.check(holds);
    }
}

fn estimator_of_matrices(t: &mut Trial) {
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
        let holds = run(t, true);
        t.check(holds);
        let holds = run(t, false);
        t.repaired(holds);
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

fn width(t: &mut Trial) {
    let widest = |system: &System, inv: &Inversion, d: &Q, v: &Q| {
        let half = half_widths(system, inv, d, v);
        half.into_iter().max().unwrap_or_else(Q::zero) * q(2)
    };
    let system = System {
        a: M::ints(&[&[1, 1], &[0, 1]]),
        c: M::ints(&[&[1, 0]]),
    };
    if let Some(inv) = system.inversion() {
        let [printed, _] = factors(&system, &inv);
        let (bound, own) = (printed.0 * q(2), widest(&system, &inv, &q(0), &q(1)));
        t.check_or(own <= bound, || {
            format!(
                "A = [1 1; 0 1], C = [1 0], d = 0, v in [-1, 1], wide x0: (17) gives {bound}, the width is {own}"
            )
        });
    }
    for _ in 0..400 {
        let (system, inv) = System::drawn(&mut t.draw);
        let (d, v) = (q(t.draw.int(0, 3)), q(t.draw.int(1, 3)));
        let own = widest(&system, &inv, &d, &v);
        let [printed, corrected] = factors(&system, &inv);
        let bound = |(bv, bd): &(Q, Q)| (bv * &v + bd * &d) * q(2);
        t.check(own <= bound(&printed));
        t.repaired(own <= bound(&corrected));
    }
}

fn amplification(t: &mut Trial) {
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
    }
}

/// One step of the predicted variance of a scalar system.
fn variance(a: &Q, c: &Q, gd: &Q, gv: &Q, p: &Q) -> Q {
    a * a * (p - p * p * c * c / (c * c * p + gv)) + gd
}

fn kalman(t: &mut Trial) {
    let one = q(1);
    let first = variance(&one, &one, &one, &one, &q(0));
    t.check_or(first <= q(0), || {
        format!("n = A = C = G_d = G_v = 1, G_0 = 0: the variance goes from 0 to {first}")
    });
    for _ in 0..300 {
        let a = frac(t.draw.int(-4, 4), 2);
        let c = q(t.draw.int(-2, 2));
        let (gd, gv) = (q(t.draw.int(0, 3)), q(t.draw.int(1, 3)));
        let mut p = vec![q(t.draw.int(0, 6))];
        for k in 0..4 {
            let next = variance(&a, &c, &gd, &gv, &p[k]);
            p.push(next);
        }
        let smaller = p.windows(2).all(|w| w[1] <= w[0]);
        t.check(smaller);
        if p[1] <= p[0] {
            t.repaired(smaller);
        }
    }
}
