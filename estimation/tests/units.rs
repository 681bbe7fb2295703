//! The law of units for draws and estimators: a diagonal change of the units of x, w, y, u and v by powers of two changes
//! no dimensionless result, bit for bit.
//!
//! Problems are made twice, once as they are and once in units between 2⁻⁴⁰ and 2⁴⁰; what comes out is divided by them and
//! compared bit for bit. Only what pays for underflow has no unit: numbers below 2⁻⁹⁰⁰ count as equal.

mod draws;

use draws::Draws;
use zonobench_estimation::propagation::decomposition::{
    Choose, JacobianBounds, Recipe, Vectors, relations,
};
use zonobench_estimation::propagation::{
    Choice, Expansion, Remainder, first_order, mean_value, zonotope_first_order,
    zonotope_mean_value,
};
use zonobench_estimation::simulate::{
    DeltaLaw, Drawn, InitialState, Inputs, Law, Noise, Truth, simulate,
};
use zonobench_estimation::systems::{Form, Linear, Lpv, VehicleSe2};
use zonobench_estimation::{
    AnyEstimator, AnySystem, Belief, EstimatorSettings, Problem, Uncertain, track,
};
use zonobench_sets::interval_matrix::jacobian_over;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{ConstrainedZonotope, Frame, Interval, IntervalVector, Matrix, Zonotope};

/// 2⁻⁹⁰⁰: below this, numbers are what underflow may have cost.
const UNDERFLOW: f64 = 1.2e-271;

fn same(a: f64, b: f64) -> bool {
    a == b || (a.abs() < UNDERFLOW && b.abs() < UNDERFLOW)
}

#[track_caller]
fn equal(what: &str, a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len(), "{what}");
    assert!(
        a.iter().zip(b).all(|(&a, &b)| same(a, b)),
        "{what}: {a:?} {b:?}"
    );
}

fn divided(x: &[f64], units: &[f64]) -> Vec<f64> {
    x.iter().zip(units).map(|(x, u)| x / u).collect()
}

/// diag(rows)⁻¹ M diag(cols).
fn moved(m: &Matrix, of_rows: &[f64], of_cols: &[f64]) -> Matrix {
    Matrix::from_fn(m.rows(), m.cols(), |i, j| {
        m[(i, j)] * of_cols[j] / of_rows[i]
    })
}

fn part_in(part: &Uncertain, units: &[f64]) -> Uncertain {
    let bounds = part.bounds.as_ref();
    let divide = |v: &Vec<f64>| divided(v, units);
    Uncertain {
        center: divided(&part.center, units),
        generators: part
            .generators
            .as_ref()
            .map(|g| moved(g, units, &vec![1.0; g.cols()])),
        bounds: bounds.map(|b| {
            IntervalVector::from_bounds(&divided(&b.lower(), units), &divided(&b.upper(), units))
                .unwrap()
        }),
        constraints: part.constraints.clone(),
        mean: part.mean.as_ref().map(divide),
        covariance: part
            .covariance
            .as_ref()
            .map(|p| Matrix::from_fn(p.rows(), p.cols(), |i, j| p[(i, j)] / units[i] / units[j])),
    }
}

/// Units of x (and w), of y (and v), and of u.
struct Units {
    x: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
}

impl Units {
    fn draw(draws: &mut Draws, n: usize, m: usize, p: usize) -> Self {
        let mut some = |n: usize| -> Vec<f64> {
            (0..n)
                .map(|_| {
                    let e = 10 + draws.below(31) as i32;
                    libm::scalbn(1.0, if draws.chance(0.5) { e } else { -e })
                })
                .collect()
        };
        Self {
            x: some(n),
            y: some(m),
            u: some(p),
        }
    }
    fn problem(&self, problem: &Problem, system: AnySystem) -> Problem {
        Problem {
            system,
            prior: part_in(&problem.prior, &self.x),
            w: part_in(&problem.w, &self.x),
            v: part_in(&problem.v, &self.y),
        }
    }
}

fn linear(a: &Matrix, b: &Matrix, c: &Matrix, d: &Matrix) -> AnySystem {
    let system = Linear::new(a.clone(), Some(b.clone()), c.clone(), Some(d.clone()));
    AnySystem::Linear(system.unwrap())
}

/// A linear problem of `n` states, and the same in other units.
fn linear_pair(n: usize, units: &Units) -> (Problem, Problem) {
    let turn = [[0.9, 0.4, 0.1], [-0.3, 0.8, 0.2], [0.05, -0.1, 0.7]];
    let a = Matrix::from_fn(n, n, |i, j| turn[i][j]);
    let b = Matrix::from_fn(n, 1, |i, _| [1.0, 0.5, -0.3][i]);
    let c = Matrix::from_fn(2, n, |i, j| [[1.0, 0.0, 0.0], [0.5, 1.0, 0.4]][i][j]);
    let d = Matrix::from_rows(&[[0.0], [0.25]]).unwrap();
    let part = |n: usize, radius: f64| {
        let spread = |i: usize| radius * [1.0, 0.7, 1.3][i];
        let radii: Vec<f64> = (0..n).map(spread).collect();
        let minus: Vec<f64> = radii.iter().map(|r| -r).collect();
        let correlated = |i, j| if i == j { 1.0 } else { 0.3 };
        Uncertain {
            covariance: Some(Matrix::from_fn(n, n, |i, j| {
                correlated(i, j) * radii[i] * radii[j]
            })),
            ..Uncertain::from_box(&minus, &radii).unwrap()
        }
    };
    let here = Problem {
        system: linear(&a, &b, &c, &d),
        prior: part(n, 2.0),
        w: part(n, 0.1),
        v: part(2, 0.2),
    };
    let system = linear(
        &moved(&a, &units.x, &units.x),
        &moved(&b, &units.x, &units.u),
        &moved(&c, &units.y, &units.x),
        &moved(&d, &units.y, &units.u),
    );
    let there = units.problem(&here, system);
    (here, there)
}

fn lpv_pair(units: &Units) -> (Problem, Problem) {
    let m = |rows: &[[f64; 2]]| Matrix::from_rows(rows).unwrap();
    let (a0, a1) = (
        m(&[[0.9, 0.4], [-0.3, 0.8]]),
        m(&[[0.02, 0.01], [-0.03, 0.05]]),
    );
    let c = m(&[[1.0, 0.3], [0.5, 1.0]]);
    let system = |u: &Units| {
        let b = Matrix::from_rows(&[[1.0], [0.5]]).unwrap();
        AnySystem::Lpv(
            Lpv::new(
                moved(&a0, &u.x, &u.x),
                vec![moved(&a1, &u.x, &u.x)],
                Some(moved(&b, &u.x, &u.u)),
                moved(&c, &u.y, &u.x),
            )
            .unwrap(),
        )
    };
    let one = Units {
        x: vec![1.0; 2],
        y: vec![1.0; 2],
        u: vec![1.0],
    };
    let (here, _) = linear_pair(2, &one);
    let here = Problem {
        system: system(&one),
        ..here
    };
    let there = units.problem(&here, system(units));
    (here, there)
}

fn parse(json: &str) -> EstimatorSettings {
    serde_json::from_str(json).unwrap()
}

type Data = (Vec<Vec<f64>>, Vec<Vec<Option<f64>>>, Vec<Vec<f64>>);

/// Inputs, measurements (now and then one is missing) and states of a run.
fn data(problem: &Problem, steps: usize, seed: u64) -> Data {
    let drawn = |of: &Uncertain| {
        Noise::Drawn(Drawn {
            law: Law::Uniform,
            of: of.clone(),
            truncate: false,
        })
    };
    let deltas = matches!(problem.system, AnySystem::Lpv(_));
    let truth = Truth {
        x0: InitialState::Drawn(problem.prior.clone()),
        w: drawn(&problem.w),
        v: drawn(&problem.v),
        delta: deltas.then_some(DeltaLaw::Constant { value: 0.5 }),
    };
    let inputs = Inputs::Constant(vec![0.5]);
    let run = simulate(&problem.system, &truth, &inputs, seed, 0, steps).unwrap();
    let mut draws = Draws::new(seed);
    let y = run.y.iter().map(|y| {
        y.iter()
            .map(|&y| (!draws.chance(0.1)).then_some(y))
            .collect()
    });
    (run.u, y.collect(), run.x)
}

fn in_units((u, y, x): &Data, units: &Units) -> Data {
    let y = y.iter().map(|y| {
        let sides = y.iter().zip(&units.y);
        sides.map(|(y, unit)| y.map(|y| y / unit)).collect()
    });
    (
        u.iter().map(|u| divided(u, &units.u)).collect(),
        y.collect(),
        x.iter().map(|x| divided(x, &units.x)).collect(),
    )
}

/// What a belief says, without units: of everything a name and the numbers.
fn said(belief: &impl Belief, units: &[f64], x: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let n = units.len();
    let mut all = vec![("center", divided(&belief.center(), units))];
    if let Some(hull) = belief.interval_hull() {
        all.push(("lower", divided(&hull.lower(), units)));
        all.push(("upper", divided(&hull.upper(), units)));
    }
    if let Some(p) = belief.covariance() {
        let entry = |a: usize| p[(a / n, a % n)] / units[a / n] / units[a % n];
        all.push(("covariance", (0..n * n).map(entry).collect()));
    }
    let (size, volume) = (belief.size(), belief.volume());
    let counts = [size.n_generators, size.n_constraints];
    all.push((
        "counts",
        counts.iter().flatten().map(|&x| x as f64).collect(),
    ));
    all.push((
        "volume",
        volume
            .iter()
            .map(|v| v / units.iter().product::<f64>())
            .collect(),
    ));
    let x: Vec<Interval> = x.iter().map(|&x| Interval::point(x)).collect();
    all.push(("verdict", vec![f64::from(belief.contains(&x) as u8)]));
    all
}

/// The first thing that two beliefs do not say alike, in their own units, of a run.
fn difference(
    settings: &EstimatorSettings,
    pair: &(Problem, Problem),
    data: &Data,
    units: &Units,
) -> Option<String> {
    let there = in_units(data, units);
    let run = |problem: &Problem, data: &Data, units: &[f64]| {
        let estimator = AnyEstimator::new(settings, problem).unwrap();
        let mut all = Vec::new();
        for (k, step) in track(&estimator, data.0.len() - 1, &data.0, &data.1).enumerate() {
            let updated = step
                .updated
                .unwrap_or_else(|e| panic!("{settings:?}, k = {k}: {e}"));
            for (phase, belief) in [("predicted", step.predicted), ("updated", Some(updated))] {
                for (what, numbers) in belief.iter().flat_map(|b| said(b, units, &data.2[k])) {
                    all.push((format!("{phase} {what} at k = {k}"), numbers));
                }
            }
        }
        all
    };
    let a = run(&pair.0, data, &units.x);
    let b = run(&pair.1, &there, &vec![1.0; units.x.len()]);
    let mut both = a.iter().zip(&b);
    let alike =
        |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(&a, &b)| same(a, b));
    let found = both.find(|((p, a), (q, b))| p != q || !alike(a, b));
    found.map(|((what, a), (_, b))| format!("{what}: {a:?} {b:?}"))
}

/// Every estimator in settings in which it compares no components, or compares them in units of the prior.
const FREE: &[&str] = &[
    r#"{"kind": "kalman"}"#,
    r#"{"kind": "ekf"}"#,
    r#"{"kind": "ukf"}"#,
    r#"{"kind": "particle", "particles": 50}"#,
    r#"{"kind": "box-state-est", "scale": "prior"}"#,
    r#"{"kind": "box-state-est", "products": "printed", "scale": "prior"}"#,
    r#"{"kind": "zfo", "generators": 12, "scale": "prior"}"#,
    r#"{"kind": "czfo", "generators": 5, "constraints": 1, "scale": "prior"}"#,
    r#"{"kind": "zmv", "generators": 12, "scale": "prior"}"#,
    r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c1", "scale": "prior"}"#,
    r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c2", "scale": "prior"}"#,
    r#"{"kind": "czmv", "generators": 12, "constraints": 3, "h": "c3", "scale": "prior"}"#,
    r#"{"kind": "czfo", "generators": 12, "constraints": 3, "h": "xb", "expansion": "lean", "scale": "prior"}"#,
    // Nothing is reduced here.
    r#"{"kind": "zmv", "generators": 4000}"#,
    r#"{"kind": "rrsr"}"#,
    r#"{"kind": "d-rrsr"}"#,
    r#"{"kind": "d-zb"}"#,
    r#"{"kind": "d-cz"}"#,
    r#"{"kind": "comb"}"#,
    r#"{"kind": "comb+"}"#,
    r#"{"kind": "lift"}"#,
    r#"{"kind": "lift", "carry": "hull"}"#,
];

const MIXED: &[&str] = &[
    r#"{"kind": "ezgkf", "phi": 12, "eta": 0.5, "alpha": 0.01, "scale": "prior"}"#,
    r#"{"kind": "ezgkf", "phi": 12, "eta": 0.5, "alpha": 0.01, "merge_parallel": true, "scale": "prior"}"#,
    r#"{"kind": "ezgkf-m", "phi": 12, "eta": 0.2, "alpha": 0.01, "overbars": false, "scale": "prior"}"#,
    r#"{"kind": "ezgkp", "phi": 12, "eta": 0.7, "alpha": 0.01, "form": "ak", "scale": "prior"}"#,
    r#"{"kind": "ezgkp", "phi": 12, "eta": 0.7, "alpha": 0.01, "form": "direct", "scale": "prior"}"#,
    r#"{"kind": "ezgkf", "phi": 4000, "eta": 0.5, "alpha": 0.01, "overbars": false}"#,
];

#[test]
fn no_estimator_depends_on_the_units_of_its_problem() {
    let mut draws = Draws::new(5);
    let mut failed = Vec::new();
    for n in [2, 3] {
        for seed in 0..2 {
            let units = Units::draw(&mut draws, n, 2, 1);
            let pair = linear_pair(n, &units);
            let data = data(&pair.0, 6, seed);
            for json in FREE.iter().chain(MIXED) {
                if let Some(what) = difference(&parse(json), &pair, &data, &units) {
                    failed.push(format!("n = {n}, seed {seed}: {json}: {what}"));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn no_mixed_filter_depends_on_the_units_of_an_lpv_problem() {
    let mut draws = Draws::new(6);
    for seed in 0..3 {
        let units = Units::draw(&mut draws, 2, 2, 1);
        let pair = lpv_pair(&units);
        let data = data(&pair.0, 7, seed);
        for json in MIXED {
            assert_eq!(
                difference(&parse(json), &pair, &data, &units),
                None,
                "{json}"
            );
        }
    }
}

/// A guard that cannot fail would be none: these compare components, as their papers do.
#[test]
fn norms_over_components_depend_on_units_where_no_scale_is_set() {
    let units = Units {
        x: vec![1024.0, 1.0, 1.0 / 1024.0],
        y: vec![1.0, 1024.0],
        u: vec![1.0],
    };
    let pair = linear_pair(3, &units);
    let data = data(&pair.0, 12, 1);
    for json in [
        r#"{"kind": "ezgkf", "phi": 6, "eta": 0.5, "alpha": 0.01}"#,
        r#"{"kind": "zmv", "generators": 6}"#,
        r#"{"kind": "czmv", "generators": 8, "constraints": 3}"#,
        r#"{"kind": "box-state-est"}"#,
    ] {
        assert_ne!(
            difference(&parse(json), &pair, &data, &units),
            None,
            "{json}"
        );
        let scaled = json.replace('}', r#", "scale": "prior"}"#);
        assert_eq!(
            difference(&parse(&scaled), &pair, &data, &units),
            None,
            "{scaled}"
        );
    }
}

/// Positions in units of 2^e m; headings are radians whatever happens.
#[test]
fn no_vehicle_filter_depends_on_the_unit_of_length() {
    let system = || AnySystem::VehicleSe2(VehicleSe2::new(0.1, Form::Euler).unwrap());
    let make = |s: f64| {
        let box_of = |r: &[f64]| {
            let minus: Vec<f64> = r.iter().map(|x| -x).collect();
            Uncertain::from_box(&minus, r).unwrap()
        };
        Problem {
            system: system(),
            prior: part_in(
                &Uncertain {
                    center: vec![0.3, 1.0, -2.0],
                    bounds: None,
                    ..box_of(&[0.1, 1.0, 0.75])
                },
                &[1.0, s, s],
            ),
            w: box_of(&[0.01, 0.05 / s, 0.03 / s]),
            v: box_of(&[0.5 / s, 0.4 / s]),
        }
    };
    for e in [-40, -10, 10, 40] {
        let s = libm::scalbn(1.0, e);
        let units = Units {
            x: vec![1.0, s, s],
            y: vec![s, s],
            u: vec![1.0, s],
        };
        let mut draws = Draws::new(9);
        let steps = 15;
        let u: Vec<Vec<f64>> = (0..=steps)
            .map(|_| vec![0.2 * draws.signed(), 5.0])
            .collect();
        let mut y = Vec::new();
        let mut x = vec![vec![0.3, 1.0, -2.0]];
        for k in 0..=steps {
            y.push(vec![
                Some(x[k][1] + 0.3 * draws.signed()),
                (!draws.chance(0.2)).then_some(x[k][2] + 0.3 * draws.signed()),
            ]);
            let [h, p, q] = x[k][..] else { unreachable!() };
            x.push(vec![
                h + 0.1 * u[k][0],
                p + 0.1 * u[k][1] * libm::cos(h),
                q + 0.1 * u[k][1] * libm::sin(h),
            ]);
        }
        let data = (u, y, x);
        for json in [
            r#"{"kind": "zsmf", "generators": 8, "scale": "prior"}"#,
            r#"{"kind": "zsmf", "generators": 8, "reduction": "girard"}"#,
            r#"{"kind": "zsmf", "generators": 8, "reduction": "paper-tables", "transient": "lag", "scale": "prior"}"#,
            r#"{"kind": "inzsmf", "generators": 8, "scale": "prior"}"#,
            r#"{"kind": "inzsmf", "generators": 8, "side": "right", "scale": "prior"}"#,
            r#"{"kind": "inzsmf", "generators": 8, "remainder": "enclosed", "scale": "prior"}"#,
            r#"{"kind": "inzsmf", "generators": 8, "remainder": "enclosed", "reduction": "girard"}"#,
        ] {
            let pair = (make(1.0), make(s));
            assert_eq!(
                difference(&parse(json), &pair, &data, &units),
                None,
                "2^{e}: {json}"
            );
        }
    }
}

#[test]
fn draws_of_every_law_are_the_same_in_any_units() {
    let mut draws = Draws::new(7);
    for n in [2, 3] {
        for seed in 0..5 {
            let units = Units::draw(&mut draws, n, 2, 1);
            let pair = linear_pair(n, &units);
            for law in [Law::Uniform, Law::Vertices, Law::Mixed, Law::Gaussian] {
                for truncate in [false, law == Law::Gaussian] {
                    let run = |problem: &Problem, u: f64| {
                        let drawn = |of: &Uncertain| {
                            Noise::Drawn(Drawn {
                                law,
                                of: of.clone(),
                                truncate,
                            })
                        };
                        let truth = Truth {
                            x0: InitialState::Drawn(problem.prior.clone()),
                            w: drawn(&problem.w),
                            v: drawn(&problem.v),
                            delta: None,
                        };
                        let inputs = Inputs::Constant(vec![u]);
                        simulate(&problem.system, &truth, &inputs, seed, 3, 8).unwrap()
                    };
                    let (here, there) = (run(&pair.0, 0.5), run(&pair.1, 0.5 / units.u[0]));
                    for (a, b, unit) in [
                        (&here.x, &there.x, &units.x),
                        (&here.w, &there.w, &units.x),
                        (&here.y, &there.y, &units.y),
                        (&here.v, &there.v, &units.y),
                        (&here.rounding, &there.rounding, &units.x),
                    ] {
                        for (a, b) in a.iter().zip(b) {
                            equal("draw", &divided(a, unit), b);
                        }
                    }
                }
            }
        }
    }
}

/// A pendulum with a bilinear term; the noise enters nonlinearly.
struct Curved<'a>(&'a [f64]);

impl Function for Curved<'_> {
    fn inputs(&self) -> usize {
        3
    }
    fn outputs(&self) -> usize {
        2
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        let u = self.0;
        let (x, y, w) = (z[0] * u[0], z[1] * u[1], z[2]);
        out[0] = (x * 0.9 + y * 0.25 + x * y * 0.125) * (1.0 / u[0]);
        out[1] = (y * 0.75 - x.sin() * 0.5 + w.sqr() * 0.25 + w) * (1.0 / u[1]);
    }
}

#[test]
fn extensions_of_nonlinear_functions_are_the_same_in_any_units() {
    let mut draws = Draws::new(8);
    let one = [1.0, 1.0];
    for _ in 0..20 {
        let units = Units::draw(&mut draws, 2, 2, 1).x;
        let g = draws.matrix(2, 4).scale(0.25);
        let z = Zonotope::new(vec![0.5, -0.25], g.clone()).unwrap();
        let a = draws.matrix(1, 4);
        // The constraint holds at ξ = 0: the center is in the set, and no point is the closest one.
        let x = |z: &Zonotope| {
            ConstrainedZonotope::with_slack(z.clone(), a.clone(), vec![0.0], vec![0.0]).unwrap()
        };
        let there = z.divided_by(&units).unwrap();
        let w = Zonotope::new(vec![0.125], Matrix::column(&[0.25])).unwrap();
        let w_set: ConstrainedZonotope = w.clone().into();
        let both = |of: &dyn Fn(&Curved, &Zonotope) -> Zonotope| {
            let (a, b) = (of(&Curved(&one), &z), of(&Curved(&units), &there));
            equal("center", &divided(a.c(), &units), b.c());
            equal("rounding box", &divided(a.r(), &units), b.r());
            let ones = vec![1.0; a.generators()];
            equal(
                "generators",
                moved(a.g(), &units, &ones).as_slice(),
                b.g().as_slice(),
            );
        };
        both(&|f, z| zonotope_mean_value(f, z, &w).unwrap());
        both(&|f, z| zonotope_first_order(f, z, &w).unwrap());
        let mut lp = LinearProgram::new();
        let hull = |x: &ConstrainedZonotope| x.interval_hull().unwrap();
        // Without constraints: where they are eliminated, Scott's scores compare components.
        both(&|f, z| {
            let (x, mut lp) = (ConstrainedZonotope::from(z.clone()), LinearProgram::new());
            let set = mean_value(f, &x, &hull(&x), &w_set, Choice::C4, &mut lp).unwrap();
            set.zonotope().clone()
        });
        both(&|f, z| {
            let (x, mut lp) = (x(z), LinearProgram::new());
            let (r, e) = (Remainder::Symmetric, Expansion::Full);
            let set = first_order(f, &x, &hull(&x), &w_set, Choice::C4, r, e, &mut lp).unwrap();
            set.zonotope().clone()
        });
        // Relations over the hull and over turned boxes.
        let frames = |z: &Zonotope, lp: &mut LinearProgram| {
            let polytope = zonobench_sets::Polytope::of_zonotope(z).unwrap();
            let polytope = polytope.simplified(lp).unwrap();
            polytope.frames(lp).unwrap()
        };
        let noise = IntervalVector::new(vec![Interval::new(-0.125, 0.375).unwrap()]);
        for (a, b) in frames(&z, &mut lp).iter().zip(&frames(&there, &mut lp)) {
            for choose in [Choose::Argmin, Choose::All] {
                let recipe = Recipe {
                    vectors: Vectors::Signed,
                    choose,
                    jacobian: JacobianBounds::Natural,
                };
                let chosen = |f: &Curved, frame: &Frame| {
                    let frame = frame.beside(&noise);
                    let j = jacobian_over(f, &frame.hull()).unwrap().1.mul(frame.back());
                    let rows = zonobench_estimation::propagation::decomposition::chosen_relations(
                        f, &frame, &j, recipe,
                    );
                    assert!(relations(f, &frame, &j, recipe.vectors).is_ok());
                    rows.unwrap()
                };
                let (here, there) = (chosen(&Curved(&one), a), chosen(&Curved(&units), b));
                for (i, (a, b)) in here.iter().zip(&there).enumerate() {
                    assert_eq!(a.len(), b.len());
                    for (a, b) in a.iter().zip(b) {
                        let ends = [a.remainder.lo() / units[i], a.remainder.hi() / units[i]];
                        equal("remainder", &ends, &[b.remainder.lo(), b.remainder.hi()]);
                    }
                }
            }
        }
    }
}
