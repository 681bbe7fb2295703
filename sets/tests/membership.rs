//! Memberships in constrained zonotopes are decided by the simplex alone, and are as exact rationals say.

mod rational;

use rational::Source;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{ConstrainedZonotope, Containment, Interval, Matrix};

/// The set of the shape (12, 12, 40), and a box around a point of it of which a share `ends` of the coordinates is ±1.
fn set_and_point(
    ends: f64,
    thin: f64,
    source: &mut Source,
) -> (ConstrainedZonotope, Vec<Interval>) {
    let (n, q, p) = (12, 12, 40);
    let g = Matrix::from_fn(n, p, |i, j| {
        let x = source.sym();
        x * if i % 3 == 0 { thin } else { 1.0 } / (1.0 + 0.2 * j as f64)
    });
    let a = Matrix::from_fn(q, p, |i, j| {
        let x = source.sym();
        if (i + j) % 3 == 0 { x } else { 0.0 }
    });
    let xi: Vec<f64> = (0..p)
        .map(|_| match source.unit() < ends {
            true => source.sym().signum(),
            false => 0.9 * source.sym(),
        })
        .collect();
    let exact = |m: &Matrix, i: usize| {
        let terms = m.row(i).iter().zip(&xi);
        terms.fold(Interval::point(0.0), |s, (&a, &x)| {
            s + Interval::point(a) * Interval::point(x)
        })
    };
    let b: Vec<Interval> = (0..q).map(|i| exact(&a, i)).collect();
    // ξ satisfies the rows within δ.
    let z = zonobench_sets::Zonotope::new(vec![0.0; n], g.clone()).unwrap();
    let middle: Vec<f64> = b.iter().map(|b| b.mid()).collect();
    let slack: Vec<f64> = b.iter().map(|b| b.rad()).collect();
    let set = ConstrainedZonotope::with_slack(z, a, middle, slack).unwrap();
    (set, (0..n).map(|i| exact(&g, i)).collect())
}

#[test]
fn a_point_of_the_set_is_found_inside_without_the_interior_point_solver() {
    let mut source = Source(41);
    let mut seen = String::new();
    let mut lost = 0;
    for thin in [1.0, 1e-4, 1e-12] {
        for ends in [0.0, 0.3, 0.6, 0.7] {
            let (mut inside, mut undecided, mut asked) = (0, 0, 0);
            for _ in 0..100 {
                let (set, x) = set_and_point(ends, thin, &mut source);
                let mut lp = LinearProgram::new();
                match set.contains_with(&x, &mut lp).unwrap() {
                    Containment::Inside => inside += 1,
                    Containment::Undecided => undecided += 1,
                    Containment::Outside => lost += 1,
                }
                asked += lp.work().fallbacks;
            }
            seen += &format!(
                "thin {thin}, {ends} at an end: {inside} inside, {undecided} undecided, {asked} asked\n"
            );
        }
    }
    println!("{seen}");
    assert_eq!(lost, 0, "{seen}");
    assert!(!seen.contains(" 1 asked"), "{seen}");
}
