//! The rounding rules of zonotopes against exact rational arithmetic.
//!
//! Every f64 is a rational number, so the exact result set of an operation on given coefficients can be
//! computed without error. ⟨c*, G*, r*⟩ ⊆ ⟨c', G', r'⟩ follows, generator by generator, from
//! |c* − c'| + Σ_j |G*_j − G'_j| + r* ≤ r'; where the lists of generators differ, exact supports are
//! compared. Inputs are random and adversarial: scales from 1e-9 to 1e9, sums that cancel, zeros,
//! products that underflow. Rules with a term left out must fail.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use zonobench_sets::reduction::{combastel, girard, parallel};
use zonobench_sets::{Containment, Interval, IntervalMatrix, Matrix, Zonotope};

type Q = BigRational;

fn q(x: f64) -> Q {
    Q::from_float(x).expect("coefficients are finite")
}

fn qs(v: &[f64]) -> Vec<Q> {
    v.iter().map(|&x| q(x)).collect()
}

fn dot(a: &[Q], b: &[Q]) -> Q {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// An exact matrix, by rows.
type Rows = Vec<Vec<Q>>;

fn rows(m: &Matrix) -> Rows {
    (0..m.rows()).map(|i| qs(m.row(i))).collect()
}

fn mul(a: &Rows, b: &Rows, cols: usize) -> Rows {
    let entry = |row: &Vec<Q>, j: usize| row.iter().zip(b).map(|(x, b)| x * &b[j]).sum();
    a.iter()
        .map(|row| (0..cols).map(|j| entry(row, j)).collect())
        .collect()
}

fn abs(m: &Rows) -> Rows {
    m.iter()
        .map(|row| row.iter().map(|x| x.abs()).collect())
        .collect()
}

fn apply(m: &Rows, v: &[Q]) -> Vec<Q> {
    m.iter().map(|row| dot(row, v)).collect()
}

/// ⟨c, G, r⟩ in rationals.
#[derive(Clone)]
struct Exact {
    c: Vec<Q>,
    g: Rows,
    r: Vec<Q>,
}

impl Exact {
    fn of(z: &Zonotope) -> Self {
        Self {
            c: qs(z.c()),
            g: rows(z.g()),
            r: qs(z.r()),
        }
    }

    fn generators(&self) -> usize {
        self.g[0].len()
    }

    /// M X + t; the box becomes the box |M| r around its image.
    fn affine_map(&self, m: &Rows, t: &[Q]) -> Self {
        let c = apply(m, &self.c)
            .iter()
            .zip(t)
            .map(|(a, b)| a + b)
            .collect();
        Self {
            c,
            g: mul(m, &self.g, self.generators()),
            r: apply(&abs(m), &self.r),
        }
    }

    /// ρ(d), exact.
    fn support(&self, d: &[Q]) -> Q {
        let along = |j: usize| -> Q { d.iter().zip(&self.g).map(|(d, row)| d * &row[j]).sum() };
        let box_part: Q = d.iter().zip(&self.r).map(|(d, r)| d.abs() * r).sum();
        let generators: Q = (0..self.generators()).map(|j| along(j).abs()).sum();
        dot(d, &self.c) + generators + box_part
    }

    /// True if the criterion shows that this set lies in `z`.
    fn lies_in(&self, z: &Zonotope) -> bool {
        assert_eq!(self.generators(), z.generators());
        let other = Self::of(z);
        (0..self.c.len()).all(|i| {
            let columns = self.g[i].iter().zip(&other.g[i]);
            let difference: Q = columns.map(|(a, b)| (a - b).abs()).sum();
            (&self.c[i] - &other.c[i]).abs() + difference + &self.r[i] <= other.r[i]
        })
    }

    /// True if the exact support is not above that of `z` in any of these directions.
    fn supported_by(&self, z: &Zonotope, directions: &[Vec<f64>]) -> bool {
        let other = Self::of(z);
        directions.iter().all(|d| {
            let d = qs(d);
            self.support(&d) <= other.support(&d)
        })
    }
}

/// SplitMix64: enough for test inputs, and the same everywhere.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Uniform in [−1, 1).
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }

    fn number(&mut self, kind: Kind) -> f64 {
        let x = self.unit();
        match kind {
            Kind::Plain => x,
            Kind::Scales | Kind::Cancelling => x * libm::exp2(self.unit() * 30.0),
            Kind::Zeros if self.below(2) == 0 => 0.0,
            Kind::Zeros => x * libm::exp2(self.unit() * 30.0),
            Kind::Underflow => match self.below(3) {
                0 => x * 1e-160,
                1 => x * 1e-310,
                _ => x * libm::exp2(self.unit() * 30.0),
            },
        }
    }

    fn vector(&mut self, n: usize, kind: Kind) -> Vec<f64> {
        (0..n).map(|_| self.number(kind)).collect()
    }

    fn matrix(&mut self, rows: usize, cols: usize, kind: Kind) -> Matrix {
        Matrix::from_fn(rows, cols, |_, _| self.number(kind))
    }

    fn zonotope(&mut self, n: usize, kind: Kind) -> Zonotope {
        let p = self.below(7);
        let r = match self.below(2) {
            0 => vec![0.0; n],
            _ => self
                .vector(n, kind)
                .iter()
                .map(|x| x.abs() * 1e-12)
                .collect(),
        };
        Zonotope::with_rounding(self.vector(n, kind), self.matrix(n, p, kind), r).unwrap()
    }

    fn directions(&mut self, n: usize) -> Vec<Vec<f64>> {
        let mut directions: Vec<Vec<f64>> = (0..6).map(|_| self.vector(n, Kind::Scales)).collect();
        for i in 0..n {
            for sign in [1.0, -1.0] {
                let mut d = vec![0.0; n];
                d[i] = sign;
                directions.push(d);
            }
        }
        directions
    }
}

/// How the inputs of a case are drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Plain,
    Scales,
    Zeros,
    Underflow,
    /// As `Scales`, and the first row of the map nearly annihilates center and generators.
    Cancelling,
}

const KINDS: [Kind; 5] = [
    Kind::Plain,
    Kind::Scales,
    Kind::Zeros,
    Kind::Underflow,
    Kind::Cancelling,
];

/// The zonotope with the last entry of every column changed so that row · column cancels.
fn annihilated(z: &Zonotope, row: &[f64]) -> Zonotope {
    let n = z.dim();
    let last = |column: &[f64]| {
        let sum: f64 = (0..n - 1).map(|k| row[k] * column[k]).sum();
        let x = -sum / row[n - 1];
        if x.is_finite() { x } else { column[n - 1] }
    };
    let mut c = z.c().to_vec();
    c[n - 1] = last(&c);
    let mut g = z.g().clone();
    for j in 0..g.cols() {
        g[(n - 1, j)] = last(&g.col(j));
    }
    Zonotope::with_rounding(c, g, z.r().to_vec()).unwrap()
}

/// A zonotope, a map of it and a translation.
fn map_case(random: &mut Random, kind: Kind) -> (Zonotope, Matrix, Vec<f64>) {
    let (n, m) = (1 + random.below(4), 1 + random.below(4));
    let map = random.matrix(m, n, kind);
    let mut z = random.zonotope(n, kind);
    let mut t = random.vector(m, kind);
    if kind == Kind::Cancelling {
        z = annihilated(&z, map.row(0));
        if random.below(2) == 0 {
            t = map.mul_vec(z.c()).iter().map(|x| -x).collect();
        }
    }
    (z, map, t)
}

/// Random cases of each kind.
const CASES: usize = 120;

#[test]
fn an_affine_map_contains_the_exact_image() {
    let mut random = Random(1);
    for kind in KINDS {
        for _ in 0..CASES {
            let (z, m, t) = map_case(&mut random, kind);
            let image = z.affine_map(&m, &t).unwrap();
            let exact = Exact::of(&z).affine_map(&rows(&m), &qs(&t));
            assert!(exact.lies_in(&image), "{kind:?}: {m:?} {z:?} + {t:?}");
        }
    }
}

/// How many of the maps of random zonotopes are lost when r' is computed by `rule` from (z, M, t).
fn lost_with(rule: impl Fn(&Zonotope, &Matrix, &[f64]) -> Vec<f64>) -> usize {
    let mut random = Random(2);
    let mut lost = 0;
    for _ in 0..CASES {
        let (z, m, t) = map_case(&mut random, Kind::Cancelling);
        let image = z.affine_map(&m, &t).unwrap();
        let r = rule(&z, &m, &t);
        let mutant = Zonotope::with_rounding(image.c().to_vec(), image.g().clone(), r).unwrap();
        let exact = Exact::of(&z).affine_map(&rows(&m), &qs(&t));
        lost += usize::from(!exact.lies_in(&mutant));
    }
    lost
}

#[test]
fn a_map_rule_without_one_of_its_terms_is_caught() {
    use zonobench_sets::rounding::{gamma, up};
    // ⌈a |M| r + b γ_{n+1} (|M| |c| + |t|) + d γ_n |M| (|G| 1)⌉; the rule has a = b = d = 1.
    let rule = |a: f64, b: f64, d: f64| {
        move |z: &Zonotope, m: &Matrix, t: &[f64]| -> Vec<f64> {
            let n = z.dim();
            let c: Vec<f64> = z.c().iter().map(|x| x.abs()).collect();
            let sums = z.abs_row_sums();
            let inner: Vec<f64> = (0..n)
                .map(|k| a * z.r()[k] + b * gamma(n + 1) * c[k] + d * gamma(n) * sums[k])
                .collect();
            let by_m = m.abs().mul_vec(&inner);
            let by_t = t.iter().map(|t| b * gamma(n + 1) * t.abs());
            by_m.iter()
                .zip(by_t)
                .map(|(m, t)| up(m + t, n + 6))
                .collect()
        }
    };
    assert_eq!(lost_with(rule(1.0, 1.0, 1.0)), 0);
    assert!(lost_with(rule(1.0, 0.0, 0.0)) > CASES / 2);
    assert!(lost_with(rule(1.0, 0.0, 1.0)) > CASES / 20);
    assert!(lost_with(rule(1.0, 1.0, 0.0)) > CASES / 20);
    assert!(lost_with(rule(0.0, 1.0, 1.0)) > CASES / 20);
}

#[test]
fn sums_and_products_contain_the_exact_ones() {
    let mut random = Random(3);
    for kind in KINDS {
        for _ in 0..CASES {
            let n = 1 + random.below(4);
            let (x, mut y) = (random.zonotope(n, kind), random.zonotope(n, kind));
            if kind == Kind::Cancelling {
                let c: Vec<f64> = x.c().iter().map(|c| -c * (1.0 + 1e-9)).collect();
                y = Zonotope::with_rounding(c, y.g().clone(), y.r().to_vec()).unwrap();
            }
            let (ex, ey) = (Exact::of(&x), Exact::of(&y));
            let joined = |a: &Rows, b: &Rows| -> Rows {
                a.iter().zip(b).map(|(a, b)| [&a[..], b].concat()).collect()
            };
            let add =
                |a: &[Q], b: &[Q]| -> Vec<Q> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
            let exact = Exact {
                c: add(&ex.c, &ey.c),
                g: joined(&ex.g, &ey.g),
                r: add(&ex.r, &ey.r),
            };
            assert!(exact.lies_in(&x.minkowski_sum(&y).unwrap()), "{x:?} {y:?}");

            let product = Exact::of(&x.cartesian_product(&y));
            let d = random.vector(2 * n, kind);
            let supports = ex.support(&qs(&d[..n])) + ey.support(&qs(&d[n..]));
            assert_eq!(product.support(&qs(&d)), supports);
        }
    }
}

/// The exact ⟨c, G, r⟩ of { x + K (y − C x − v) }, its box part by absolute values.
fn exact_update(x: &Zonotope, k: &Matrix, c: &Matrix, y: &[f64], v: &Zonotope) -> Exact {
    let n = x.dim();
    let (ex, ev) = (Exact::of(x), Exact::of(v));
    let (k, c) = (rows(k), rows(c));
    let kc = mul(&k, &c, n);
    let m: Rows = (0..n)
        .map(|i| {
            let identity = |j: usize| if i == j { q(1.0) } else { Q::zero() };
            (0..n).map(|j| identity(j) - &kc[i][j]).collect()
        })
        .collect();
    let predicted = apply(&c, &ex.c);
    let innovation: Vec<Q> = (0..y.len())
        .map(|i| q(y[i]) - &predicted[i] - &ev.c[i])
        .collect();
    let shift = apply(&k, &innovation);
    let noise = mul(&k, &ev.g, ev.generators());
    let own = mul(&m, &ex.g, ex.generators());
    let boxes = apply(&abs(&m), &ex.r)
        .into_iter()
        .zip(apply(&abs(&k), &ev.r))
        .map(|(a, b)| a + b)
        .collect();
    Exact {
        c: ex.c.iter().zip(&shift).map(|(a, b)| a + b).collect(),
        g: own
            .into_iter()
            .zip(noise)
            .map(|(a, b)| a.into_iter().chain(b.into_iter().map(|x| -x)).collect())
            .collect(),
        r: boxes,
    }
}

#[test]
fn an_update_by_any_gain_contains_the_exact_one() {
    let mut random = Random(4);
    for kind in KINDS {
        for _ in 0..CASES {
            let (n, dim_y) = (1 + random.below(3), 1 + random.below(3));
            let x = random.zonotope(n, kind);
            let v = random.zonotope(dim_y, kind);
            let c = random.matrix(dim_y, n, kind);
            let mut k = random.matrix(n, dim_y, kind);
            let mut y = random.vector(dim_y, kind);
            if kind == Kind::Cancelling {
                // A gain that nearly inverts C, and a measurement close to the predicted one.
                k[(0, 0)] = 1.0 / c[(0, 0)];
                y = c
                    .mul_vec(x.c())
                    .iter()
                    .zip(v.c())
                    .map(|(a, b)| a + b)
                    .collect();
            }
            let updated = x.update(&k, &c, &y, &v).unwrap();
            let exact = exact_update(&x, &k, &c, &y, &v);
            assert!(
                exact.lies_in(&updated),
                "{kind:?}: {x:?} {k:?} {c:?} {y:?} {v:?}"
            );
        }
    }
}

#[test]
fn an_update_that_trusts_the_rounded_i_minus_kc_is_caught() {
    // K C is 1 after rounding, so I − K C is computed as 0 although it is 2⁻⁵⁴: all of r' is that term.
    let x = Zonotope::new(vec![0.0], Matrix::column(&[1e9])).unwrap();
    let v = Zonotope::point(&[0.0]).unwrap();
    let (k, c) = (Matrix::column(&[1.0 / 3.0]), Matrix::column(&[3.0]));
    let updated = x.update(&k, &c, &[0.0], &v).unwrap();
    assert_eq!(updated.g()[(0, 0)], 0.0);
    let exact = exact_update(&x, &k, &c, &[0.0], &v);
    assert!(exact.lies_in(&updated));
    let mutant = Zonotope::new(updated.c().to_vec(), updated.g().clone()).unwrap();
    assert!(!exact.lies_in(&mutant));
}

/// Products of entries of a matrix that underflow are off by up to 2⁻¹⁰⁷⁵, which the extent of the set multiplies.
#[test]
fn products_that_underflow_under_a_huge_set_are_charged() {
    let two = |e: i32| libm::exp2(f64::from(e));
    // The first component is 0 and moves by (K C)_12 x_2; (K C)_12 = 2⁻¹⁰⁷⁵ is computed as 0.
    let k = Matrix::column(&[two(-600), 0.0]);
    let c = Matrix::from_rows(&[[0.0, two(-475)]]).unwrap();
    let v = Zonotope::point(&[0.0]).unwrap();
    let tall = Zonotope::new(vec![0.0; 2], Matrix::column(&[0.0, two(200)])).unwrap();
    let r = vec![0.0, two(200)];
    let wide = Zonotope::with_rounding(vec![0.0; 2], Matrix::zeros(2, 0), r).unwrap();
    for x in [tall, wide] {
        let updated = x.update(&k, &c, &[0.0], &v).unwrap();
        assert!(
            exact_update(&x, &k, &c, &[0.0], &v).lies_in(&updated),
            "{updated:?}"
        );
    }
}

#[test]
fn reductions_keep_columns_and_box_the_others_upward() {
    let mut random = Random(5);
    for kind in KINDS {
        for _ in 0..CASES {
            let n = 1 + random.below(3);
            let p = n + 1 + random.below(12);
            let g = random.matrix(n, p, kind);
            let r: Vec<f64> = random
                .vector(n, kind)
                .iter()
                .map(|x| x.abs() * 1e-9)
                .collect();
            let z = Zonotope::with_rounding(random.vector(n, kind), g, r).unwrap();
            let generators = n + random.below(p - n);
            for reduced in [
                combastel::reduce(&z, generators).unwrap(),
                girard::reduce(&z, generators).unwrap(),
            ] {
                assert_eq!(reduced.generators(), generators);
                assert_eq!(reduced.c(), z.c());
                let mut rest: Vec<usize> = (0..p).collect();
                for j in 0..generators - n {
                    let column = reduced.g().col(j);
                    let at = rest.iter().position(|&l| z.g().col(l) == column);
                    rest.remove(at.expect("a kept column is one of the original"));
                }
                for i in 0..n {
                    let exact: Q = rest.iter().map(|&j| q(z.g()[(i, j)].abs())).sum();
                    let side = q(reduced.g()[(i, generators - n + i)]) + q(reduced.r()[i]);
                    assert!(exact + q(z.r()[i]) <= side, "{kind:?}: {z:?}");
                }
                let directions = random.directions(n);
                assert!(Exact::of(&z).supported_by(&reduced, &directions));
            }
        }
    }
}

#[test]
fn merged_parallel_generators_contain_the_exact_ones() {
    let mut random = Random(6);
    for kind in KINDS {
        for case in 0..CASES {
            let n = 1 + random.below(3);
            let directions = random.matrix(n, 2, kind);
            // Multiples of two directions, exact up to rounding or to a relative 1e-6.
            let g = Matrix::from_fn(n, 8, |i, j| directions[(i, j % 2)]);
            let factors = random.vector(8, Kind::Scales);
            let bend = if case % 2 == 0 { 0.0 } else { 1e-6 };
            let g = Matrix::from_fn(n, 8, |i, j| {
                g[(i, j)] * factors[j] * (1.0 + bend * random.unit())
            });
            let z = Zonotope::new(random.vector(n, kind), g).unwrap();
            for tolerance in [0.0, 1e-12, 1e-3] {
                let merged = parallel::merge(&z, tolerance).unwrap();
                if tolerance == 1e-3 && kind == Kind::Plain {
                    assert!(
                        merged.generators() <= 4,
                        "at most a sign of the pivot row apart"
                    );
                }
                let exact = Exact::of(&z);
                let directions = random.directions(n);
                assert!(
                    exact.supported_by(&merged, &directions),
                    "{tolerance}: {z:?}"
                );
            }
        }
    }
}

#[test]
fn folding_changes_no_support() {
    let mut random = Random(7);
    for kind in KINDS {
        for _ in 0..CASES {
            let n = 1 + random.below(4);
            let z = random.zonotope(n, kind);
            let folded = Exact::of(&z.clone().fold());
            for d in random.directions(n) {
                assert_eq!(folded.support(&qs(&d)), Exact::of(&z).support(&qs(&d)));
            }
        }
    }
}

#[test]
fn hulls_and_supports_enclose_the_exact_ones() {
    let mut random = Random(8);
    for kind in KINDS {
        for _ in 0..CASES {
            let n = 1 + random.below(4);
            let d = random.vector(n, kind);
            let mut z = random.zonotope(n, kind);
            if kind == Kind::Cancelling {
                z = annihilated(&z, &d);
            }
            let exact = Exact::of(&z);
            let bounds = z.support_bounds(&d).unwrap();
            let support = exact.support(&qs(&d));
            assert!(
                q(bounds.lo()) <= support && support <= q(bounds.hi()),
                "{z:?} {d:?}"
            );
            for (i, side) in z.interval_hull().unwrap().iter().enumerate() {
                let mut e = vec![Q::zero(); n];
                e[i] = q(1.0);
                assert!(exact.support(&e) <= q(side.hi()));
                e[i] = q(-1.0);
                assert!(-exact.support(&e) >= q(side.lo()));
            }
        }
    }
}

#[test]
fn an_interval_map_contains_the_image_under_every_corner_matrix() {
    let mut random = Random(9);
    for kind in KINDS {
        for _ in 0..CASES / 4 {
            let (n, m) = (1 + random.below(3), 1 + random.below(3));
            let a = random.matrix(m, n, kind);
            let b = random.matrix(m, n, kind);
            let bounds =
                |f: fn(f64, f64) -> f64| Matrix::from_fn(m, n, |i, j| f(a[(i, j)], b[(i, j)]));
            let map = IntervalMatrix::from_bounds(&bounds(f64::min), &bounds(f64::max)).unwrap();
            let z = random.zonotope(n, kind);
            let t = random.vector(m, kind);
            let image = z.interval_affine_map(&map, &t).unwrap();
            for _ in 0..4 {
                let corner = Matrix::from_fn(m, n, |i, j| match random.below(2) {
                    0 => a[(i, j)],
                    _ => b[(i, j)],
                });
                for d in random.directions(m) {
                    let pulled = apply(&rows(&corner.transpose()), &qs(&d));
                    let support = Exact::of(&z).support(&pulled) + dot(&qs(&d), &qs(&t));
                    assert!(
                        support <= Exact::of(&image).support(&qs(&d)),
                        "{map:?} {z:?}"
                    );
                }
            }
        }
    }
}

/// True if c + G ξ + s = x has a solution, n = 2: |dᵀ(x − c)| ≤ ρ(X − c, d) at all normals and axes.
fn exactly_inside(z: &Zonotope, x: &[f64]) -> bool {
    let mut centered = Exact::of(z);
    let offset: Vec<Q> = x.iter().zip(&centered.c).map(|(&x, c)| q(x) - c).collect();
    centered.c = vec![Q::zero(); 2];
    let mut normals = vec![vec![q(1.0), Q::zero()], vec![Q::zero(), q(1.0)]];
    normals.extend(
        (0..centered.generators()).map(|j| vec![-&centered.g[1][j], centered.g[0][j].clone()]),
    );
    normals
        .iter()
        .all(|d| dot(d, &offset).abs() <= centered.support(d))
}

#[test]
fn planar_containment_is_never_wrong_and_decides_away_from_the_boundary() {
    let mut random = Random(10);
    let mut verdicts = [0; 3];
    for kind in KINDS {
        for _ in 0..CASES {
            let z = random.zonotope(2, kind);
            let vertices = z.vertices().unwrap();
            let [vx, vy] = vertices[random.below(vertices.len())];
            // Points along the way to a vertex: within, at it up to some ulps, beyond.
            let share = match random.below(4) {
                0 => 1.0 + random.unit() * 1e-15,
                1 => 1.0 + random.unit() * 1e-6,
                _ => 1.0 + random.unit(),
            };
            let x = [
                z.c()[0] + share * (vx - z.c()[0]),
                z.c()[1] + share * (vy - z.c()[1]),
            ];
            let verdict = z.contains(&x.map(Interval::point)).unwrap();
            let truth = exactly_inside(&z, &x);
            match verdict {
                Containment::Inside => assert!(truth, "{kind:?}: {z:?} {x:?}"),
                Containment::Outside => assert!(!truth, "{kind:?}: {z:?} {x:?}"),
                Containment::Undecided => {}
            }
            if kind == Kind::Plain && z.generators() >= 2 && (share - 1.0).abs() > 1e-3 {
                assert_ne!(verdict, Containment::Undecided, "{z:?} {x:?}");
            }
            verdicts[verdict as usize] += 1;
        }
    }
    let seldom = CASES / 4;
    assert!(verdicts.iter().all(|&n| n > seldom), "{verdicts:?}");
}

/// M = 0.99 · rotation(0.7).
fn contracting_rotation() -> Matrix {
    let (s, c) = (0.99 * libm::sin(0.7), 0.99 * libm::cos(0.7));
    Matrix::from_rows(&[[c, -s], [s, c]]).unwrap()
}

#[test]
fn folded_rounding_does_not_wrap_and_carried_rounding_does() {
    let m = contracting_rotation();
    let start = Zonotope::new(vec![1.0, 1.0], Matrix::identity(2)).unwrap();
    let t = [0.3, -0.2];

    let mut folded = start.clone();
    for k in 0..10_000 {
        folded = folded.affine_map(&m, &t).unwrap().fold();
        // Boxing wraps too: with 20 generators in place of 400 this grows as well.
        folded = combastel::reduce(&folded, 400).unwrap();
        if k > 4000 {
            let radius = folded.radius();
            assert!(radius.iter().all(|&r| r < 1e-12), "{k}: {radius:?}");
        }
    }

    let mut carried = start;
    let overflow = (0..10_000).find(|_| match carried.affine_map(&m, &t) {
        Ok(next) => {
            carried = next;
            false
        }
        Err(_) => true,
    });
    assert!(overflow.is_some(), "|M| has spectral radius above 1");
}
