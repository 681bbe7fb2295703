//! The guide's table of names that users bring: each method there, written down from its source, beside ours on a linear
//! system of two states.

use zonobench_estimation::systems::Linear;
use zonobench_estimation::{AnyEstimator, AnySystem, Belief, Problem, Uncertain, track};
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

fn m(rows: &[&[f64]]) -> Matrix {
    Matrix::from_rows(rows).unwrap()
}

const A: [[f64; 2]; 2] = [[0.9, 0.4], [-0.3, 0.8]];
const C: [f64; 2] = [1.0, 0.5];
const W: f64 = 0.1;
const V: f64 = 0.2;

/// x⁺ = A x + w, y = C x + v, |w_i| ≤ 0.1, |v| ≤ 0.2, |x_0i| ≤ 2.
fn problem() -> Problem {
    let side = |n: usize, r: f64| Uncertain::from_box(&vec![-r; n], &vec![r; n]).unwrap();
    Problem {
        system: AnySystem::Linear(
            Linear::new(Matrix::from_rows(&A).unwrap(), None, m(&[&C]), None).unwrap(),
        ),
        prior: side(2, 2.0),
        w: side(2, W),
        v: side(1, V),
    }
}

/// Measurements of x_0 = (1.5, −1) with noise on the vertices of its bounds.
fn measurements(steps: usize) -> Vec<Vec<Option<f64>>> {
    let mut x = [1.5, -1.0];
    let sign = |bit: usize| if bit.is_multiple_of(2) { 1.0 } else { -1.0 };
    (0..=steps)
        .map(|k| {
            let y = C[0] * x[0] + C[1] * x[1] + V * sign(k / 2);
            let w = [W * sign(k), W * sign(k / 3)];
            x = [
                A[0][0] * x[0] + A[0][1] * x[1] + w[0],
                A[1][0] * x[0] + A[1][1] * x[1] + w[1],
            ];
            vec![Some(y)]
        })
        .collect()
}

/// The updated beliefs of an estimator.
fn beliefs(settings: &str, steps: usize) -> Vec<impl Belief> {
    let settings = serde_json::from_str(settings).unwrap();
    let estimator = AnyEstimator::new(&settings, &problem()).unwrap();
    let y = measurements(steps);
    track(&estimator, steps, &[], &y)
        .map(|step| step.updated.unwrap())
        .collect()
}

/// Sixteen directions around the plane.
fn directions() -> impl Iterator<Item = [f64; 2]> {
    (0..16).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 16.0;
        [libm::cos(angle), libm::sin(angle)]
    })
}

/// max { dᵀx } over the corners of a convex polygon.
fn support(polygon: &[[f64; 2]], d: [f64; 2]) -> f64 {
    let along = |x: &[f64; 2]| d[0] * x[0] + d[1] * x[1];
    polygon.iter().map(along).fold(f64::NEG_INFINITY, f64::max)
}

/// The part of a convex polygon where dᵀx ≤ s.
fn cut(polygon: &[[f64; 2]], d: [f64; 2], s: f64) -> Vec<[f64; 2]> {
    let over = |x: &[f64; 2]| d[0] * x[0] + d[1] * x[1] - s;
    let mut kept = Vec::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (over_a, over_b) = (over(a), over(b));
        if over_a <= 0.0 {
            kept.push(*a);
        }
        if (over_a < 0.0 && over_b > 0.0) || (over_a > 0.0 && over_b < 0.0) {
            let t = over_a / (over_a - over_b);
            kept.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    kept
}

/// The convex hull of some points, counter-clockwise (Andrew's chain).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |o: &[f64; 2], a: &[f64; 2], b: &[f64; 2]| {
        (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
    };
    let chain = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut out: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while out.len() > 1 && turn(&out[out.len() - 2], &out[out.len() - 1], p) <= 0.0 {
                out.pop();
            }
            out.push(*p);
        }
        out.pop();
        out
    };
    let mut all = chain(&mut points.iter());
    all.extend(chain(&mut points.iter().rev()));
    all
}

/// CZN keeps the exact set of states that agree with all that was measured; here as a polygon.
#[test]
fn czn_is_czmv_because_the_mean_value_extension_is_exact_on_a_linear_system() {
    let ours = beliefs(
        r#"{"kind": "czmv", "generators": 200, "constraints": 60}"#,
        12,
    );
    let mut polygon = vec![[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
    for (k, (belief, y)) in ours.iter().zip(measurements(12)).enumerate() {
        if k > 0 {
            let corners = [[-W, -W], [W, -W], [W, W], [-W, W]];
            let moved = polygon.iter().flat_map(|x| {
                let at = |i: usize| A[i][0] * x[0] + A[i][1] * x[1];
                let to = [at(0), at(1)];
                corners.map(|w| [to[0] + w[0], to[1] + w[1]])
            });
            polygon = hull(moved.collect());
        }
        let y = y[0].unwrap();
        polygon = cut(&polygon, C, y + V);
        polygon = cut(&polygon, C.map(|c| -c), V - y);
        let shape = belief.shape();
        let (a, b) = shape.constraints.unwrap();
        let set = ConstrainedZonotope::new(shape.center, shape.generators.unwrap(), a, b).unwrap();
        for d in directions() {
            let (exact, ours) = (support(&polygon, d), set.support(&d).unwrap());
            // Ours holds the exact set, and a certified bound of a program is 1e-9 wide of it at most.
            let gap = ours - exact;
            assert!((-1e-12..1e-9).contains(&gap), "k = {k}: {gap}");
        }
    }
}

/// Bravo 2006: of the zonotope and, for each generator, the one that has the strip's direction in its place, the one of
/// the least det(T Tᵀ), the strip first narrowed to what the zonotope reaches.
#[test]
fn volmin_b_is_the_update_of_zmv() {
    let ours = beliefs(r#"{"kind": "zmv", "generators": 100}"#, 12);
    let (mut c, mut g) = ([0.0, 0.0], vec![[2.0, 0.0], [0.0, 2.0]]);
    let times = |x: [f64; 2]| [0, 1].map(|i| A[i][0] * x[0] + A[i][1] * x[1]);
    let along = |x: [f64; 2]| C[0] * x[0] + C[1] * x[1];
    let measure = |g: &[[f64; 2]]| {
        let sum = |i: usize, j: usize| g.iter().map(|x| x[i] * x[j]).sum::<f64>();
        sum(0, 0) * sum(1, 1) - sum(0, 1) * sum(0, 1)
    };
    for (k, (belief, y)) in ours.iter().zip(measurements(12)).enumerate() {
        if k > 0 {
            c = times(c);
            g = g.into_iter().map(times).collect();
            g.extend([[W, 0.0], [0.0, W]]);
        }
        let y = y[0].unwrap();
        let reach: f64 = g.iter().map(|&x| along(x).abs()).sum();
        let (lo, hi) = ((y - V).max(along(c) - reach), (y + V).min(along(c) + reach));
        let (y, sigma) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let mut best = (measure(&g), c, g.clone());
        for j in 0..g.len() {
            let q = along(g[j]);
            if q == 0.0 {
                continue;
            }
            let direction = g[j].map(|x| x / q);
            let mut other: Vec<[f64; 2]> = (g.iter())
                .map(|&x| [0, 1].map(|i| x[i] - along(x) * direction[i]))
                .collect();
            other[j] = direction.map(|x| sigma * x);
            let at = [0, 1].map(|i| c[i] + (y - along(c)) * direction[i]);
            let volume = measure(&other);
            if volume < best.0 * (1.0 - 1e-12) {
                best = (volume, at, other);
            }
        }
        (_, c, g) = best;
        let shape = belief.shape();
        let set = Zonotope::new(shape.center, shape.generators.unwrap()).unwrap();
        for d in directions() {
            let dot = |x: [f64; 2]| d[0] * x[0] + d[1] * x[1];
            let theirs = dot(c) + g.iter().map(|&x| dot(x).abs()).sum::<f64>();
            // Rounding of sums of at most thirty terms below 5, which ours holds.
            let gap = set.support(&d).unwrap() - theirs;
            assert!(gap.abs() < 1e-12, "k = {k}: {gap}");
        }
    }
}

/// Combastel 2015: K = G Gᵀ Cᵀ (C G Gᵀ Cᵀ + V Vᵀ)⁻¹ makes ‖[(I − K C) G, −K V]‖_F least.
#[test]
fn frad_is_ezgkf_without_a_gaussian_part() {
    let settings = r#"{"kind": "ezgkf", "phi": 100, "eta": 0, "alpha": 0.5}"#;
    let ours = beliefs(settings, 12);
    let (mut c, mut g) = ([0.0, 0.0], vec![[2.0, 0.0], [0.0, 2.0]]);
    let times = |x: [f64; 2]| [0, 1].map(|i| A[i][0] * x[0] + A[i][1] * x[1]);
    let along = |x: [f64; 2]| C[0] * x[0] + C[1] * x[1];
    // The filter starts with y_1.
    for (k, (belief, y)) in ours.iter().zip(measurements(12)).enumerate().skip(1) {
        c = times(c);
        g = g.into_iter().map(times).collect();
        g.extend([[W, 0.0], [0.0, W]]);
        let s = g.iter().map(|&x| along(x) * along(x)).sum::<f64>() + V * V;
        let gain = [0, 1].map(|i| g.iter().map(|&x| x[i] * along(x)).sum::<f64>() / s);
        let z = y[0].unwrap() - along(c);
        c = [0, 1].map(|i| c[i] + gain[i] * z);
        g = (g.into_iter())
            .map(|x| [0, 1].map(|i| x[i] - gain[i] * along(x)))
            .collect();
        g.push(gain.map(|k| -k * V));
        let (center, shape) = (belief.center(), belief.shape());
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(center[0], c[0]) && close(center[1], c[1]), "k = {k}");
        let generators = shape.generators.unwrap();
        for d in directions() {
            let dot = |x: [f64; 2]| d[0] * x[0] + d[1] * x[1];
            let theirs: f64 = g.iter().map(|&x| dot(x).abs()).sum();
            let all = (0..generators.cols()).map(|j| [generators[(0, j)], generators[(1, j)]]);
            let ours: f64 = all.map(|x| dot(x).abs()).sum();
            // Thirty terms below 5, in another order.
            assert!(close(ours, theirs), "k = {k}: {ours} {theirs}");
        }
    }
}
