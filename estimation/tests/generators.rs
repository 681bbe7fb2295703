//! The generator form of the polytopic filters: the same as the closed form where both apply, hand examples,
//! and exact truth at vertices of sets that are no boxes.

mod draws;

use draws::Draws;
use zonobench_estimation::propagation::decomposition::{
    Choose, JacobianBounds, Recipe, Vectors, chosen_relations, jacobian_bounds, linear_parts,
};
use zonobench_estimation::propagation::generators::{
    generator_relations, propagate, propagate_bundle, update, update_bundle, update_by_mean_value,
};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{
    ConstrainedZonotope, Containment, Frame, Interval, IntervalVector, Matrix, Polytope, Zonotope,
};

const ALL: Recipe = Recipe {
    vectors: Vectors::Paper,
    choose: Choose::All,
    jacobian: JacobianBounds::Natural,
};
const BEST: Recipe = Recipe {
    vectors: Vectors::Signed,
    choose: Choose::Argmin,
    jacobian: JacobianBounds::Decomposition,
};

/// x_i ↦ a_i x + Σ q_ijk x_j x_k over the first `states`, the other inputs added linearly by `a`.
struct Quadratic {
    a: Matrix,
    q: Vec<Matrix>,
}

impl Quadratic {
    fn random(n: usize, inputs: usize, outputs: usize, draws: &mut Draws) -> Self {
        let q = (0..outputs).map(|_| {
            let m = draws.matrix(n, n);
            Matrix::from_fn(inputs, inputs, |i, j| {
                if i < n && j < n { 0.3 * m[(i, j)] } else { 0.0 }
            })
        });
        let q = q.collect();
        Self {
            a: draws.matrix(outputs, inputs),
            q,
        }
    }
}

impl Function for Quadratic {
    fn inputs(&self) -> usize {
        self.a.cols()
    }
    fn outputs(&self) -> usize {
        self.a.rows()
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = S::constant(0.0);
            for (j, &z_j) in z.iter().enumerate() {
                *out = *out + z_j * self.a[(i, j)];
                for (k, &z_k) in z.iter().enumerate() {
                    let q = self.q[i][(j, k)];
                    if q != 0.0 {
                        *out = *out + if j == k { z_j.sqr() * q } else { z_j * z_k * q };
                    }
                }
            }
        }
    }
}

/// A box cut by two slabs, as a polytope whose hull is tight, with its middle inside.
fn polytope(n: usize, draws: &mut Draws) -> Polytope {
    let c: Vec<f64> = (0..n).map(|_| draws.signed()).collect();
    let sides: Vec<Interval> = c
        .iter()
        .map(|&c| Interval::from_center_radius(c, 0.2 + draws.unit()))
        .collect();
    let slabs: Vec<_> = (0..2)
        .map(|_| {
            let normal: Vec<f64> = (0..n).map(|_| draws.signed()).collect();
            let at = IntervalVector::point(&c).unwrap();
            let slab = zonobench_sets::Slab {
                range: Interval::ZERO,
                normal,
            };
            let middle = slab.product(at.as_slice()).mid();
            zonobench_sets::Slab {
                range: Interval::from_center_radius(middle, 0.3),
                ..slab
            }
        })
        .collect();
    let raw = Polytope::new(IntervalVector::new(sides), slabs).unwrap();
    raw.simplified(&mut LinearProgram::new()).unwrap()
}

fn directions(n: usize, draws: &mut Draws) -> Vec<Vec<f64>> {
    (0..8)
        .map(|_| (0..n).map(|_| draws.signed()).collect())
        .collect()
}

/// The supports of two sets agree within `tol` of their size.
fn same_set(a: &ConstrainedZonotope, b: &ConstrainedZonotope, draws: &mut Draws, tol: f64) {
    let (x, y) = (a.interval_hull().unwrap(), b.interval_hull().unwrap());
    let size = x.widths().into_iter().fold(0.0, f64::max);
    for (x, y) in x.iter().zip(&y) {
        assert!((x.lo() - y.lo()).abs() <= tol * size, "{x:?} {y:?}");
        assert!((x.hi() - y.hi()).abs() <= tol * size, "{x:?} {y:?}");
    }
    for d in directions(a.dim(), draws) {
        let (s, t) = (a.support(&d).unwrap(), b.support(&d).unwrap());
        assert!((s - t).abs() <= tol * size, "{d:?}: {s} {t}");
    }
}

#[test]
fn with_added_noise_of_a_box_both_forms_are_the_same_relations_and_the_same_sets() {
    let mut draws = Draws::new(71);
    for n in [2, 2, 2, 3] {
        for recipe in [ALL, BEST] {
            let p = polytope(n, &mut draws);
            let f = Quadratic::random(n, n, n, &mut draws);
            let x = p.to_constrained_zonotope().unwrap();
            let w =
                ConstrainedZonotope::from_box(&IntervalVector::new(vec![
                    Interval::new(-0.1, 0.2)
                        .unwrap();
                    n
                ]))
                .unwrap();
            // Over the hull, in x.
            let frame = Frame::identity(p.hull());
            let j = jacobian_bounds(&f, &frame, recipe.jacobian, recipe.vectors).unwrap();
            let closed = chosen_relations(&f, &frame, &j, recipe).unwrap();
            let own = generator_relations(&f, &x, recipe).unwrap();
            for (closed, own) in closed.iter().zip(&own) {
                assert_eq!(closed.len(), own.len());
                for (c, o) in closed.iter().zip(own) {
                    for (k, (m, h)) in c.linear.iter().zip(&o.linear).enumerate() {
                        let r = x.g()[(k, k)];
                        assert!((m * r - h).abs() < 1e-9, "{m} {r} {h}");
                    }
                    assert!((c.remainder.width() - o.remainder.width()).abs() < 1e-9);
                }
            }
            // As sets, w added to either, or carried along in z = (x, w).
            let with_noise =
                Quadratic {
                    a: Matrix::hcat(&[&f.a, &Matrix::identity(n)]),
                    q: f.q
                        .iter()
                        .map(|q| {
                            Matrix::from_fn(2 * n, 2 * n, |i, j| {
                                if i < n && j < n { q[(i, j)] } else { 0.0 }
                            })
                        })
                        .collect(),
                };
            let z = x.cartesian_product(&w);
            let images = propagate(&with_noise, &z, BEST).unwrap();
            assert_eq!(images.len(), 1);
            let j = jacobian_bounds(&f, &frame, BEST.jacobian, BEST.vectors).unwrap();
            let rows = chosen_relations(&f, &frame, &j, BEST).unwrap();
            let choice: Vec<_> = rows.iter().map(|row| &row[0]).collect();
            let middle: Vec<f64> = choice.iter().map(|r| r.remainder.mid()).collect();
            let sides: Vec<f64> = choice.iter().map(|r| r.remainder.rad()).collect();
            let image = x.affine_map(&linear_parts(&choice), &middle).unwrap();
            let image = image.plus_box(&sides).unwrap().minkowski_sum(&w).unwrap();
            same_set(&images[0], &image, &mut draws, 1e-9);
            // The update with a box: slabs, or the generators of Y.
            let y = f_value(&f, &p.hull().mid());
            let range: Vec<Interval> = y
                .iter()
                .map(|&y| Interval::from_center_radius(y, 0.3))
                .collect();
            let by_generators = update(
                &f,
                &x,
                &ConstrainedZonotope::from_box(&IntervalVector::new(range.clone())).unwrap(),
                recipe,
            )
            .unwrap();
            let j = jacobian_bounds(&f, &frame, recipe.jacobian, recipe.vectors).unwrap();
            let rows = chosen_relations(&f, &frame, &j, recipe).unwrap();
            let slabs: Vec<_> = rows
                .iter()
                .zip(&range)
                .flat_map(|(row, &y)| row.iter().map(move |r| (r, y)))
                .map(|(r, y)| zonobench_sets::Slab {
                    normal: r.linear.clone(),
                    range: y - r.remainder,
                })
                .collect();
            same_set(&by_generators, &x.within(&slabs).unwrap(), &mut draws, 1e-9);
        }
    }
}

fn f_value(f: &impl Function, z: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; f.outputs()];
    f.evaluate(z, &mut out);
    out
}

/// f at the point, enclosed.
fn f_over(f: &impl Function, z: &[Interval]) -> Vec<Interval> {
    let mut out = vec![Interval::ZERO; f.outputs()];
    f.evaluate(z, &mut out);
    out
}

/// c + G ξ, enclosed.
fn member(z: &Zonotope, xi: &[f64]) -> Vec<Interval> {
    (0..z.dim())
        .map(|i| {
            let terms = z.g().row(i).iter().zip(xi);
            terms.fold(Interval::point(z.c()[i]), |s, (&g, &xi)| {
                s + Interval::point(g) * Interval::point(xi)
            })
        })
        .collect()
}

fn vertex(p: usize, draws: &mut Draws) -> Vec<f64> {
    (0..p)
        .map(|_| if draws.chance(0.5) { 1.0 } else { -1.0 })
        .collect()
}

fn holds(set: &ConstrainedZonotope, x: &[Interval]) {
    assert_ne!(set.contains(x).unwrap(), Containment::Outside, "{x:?}");
}

#[test]
fn vertices_of_zonotopes_with_more_generators_than_dimensions_are_kept_by_every_lemma() {
    let mut draws = Draws::new(72);
    for _ in 0..20 {
        let n = 2;
        let zonotope = |p: usize, size: f64, draws: &mut Draws| {
            let c: Vec<f64> = (0..n).map(|_| draws.signed()).collect();
            Zonotope::new(c, draws.matrix(n, p).scale(size)).unwrap()
        };
        let x = zonotope(3, 0.3, &mut draws);
        // The noise is multiplied by the state and by itself.
        let w = zonotope(4, 0.1, &mut draws);
        let f = Quadratic::random(2 * n, 2 * n, n, &mut draws);
        let mu = Quadratic::random(n, n, n, &mut draws);
        let z = x.cartesian_product(&w);
        // Of a set with a rounding box its corners belong to it.
        let r = vec![1e-3; 2 * n];
        let wide = Zonotope::with_rounding(z.c().to_vec(), z.g().clone(), r).unwrap();
        for recipe in [
            BEST,
            Recipe {
                choose: Choose::Argmin,
                ..ALL
            },
        ] {
            let image = &propagate(&f, &wide.clone().into(), recipe).unwrap()[0];
            let bundle = propagate_bundle(&f, &[z.clone(), wide.clone()], recipe).unwrap();
            assert_eq!(bundle.len(), 2);
            for _ in 0..30 {
                let xi = vertex(7, &mut draws);
                let point = member(&z, &xi);
                for zonotope in &bundle {
                    let next = f_over(&f, &point);
                    holds(&zonotope.clone().into(), &next);
                }
                let corner: Vec<Interval> = point
                    .iter()
                    .zip(vertex(4, &mut draws))
                    .map(|(&z, s)| z + Interval::point(0.999e-3 * s))
                    .collect();
                holds(image, &f_over(&f, &corner));
            }
            for _ in 0..10 {
                // A measured vertex, with a noise on the vertices of a zonotope of five generators.
                let xi = vertex(3, &mut draws);
                let truth = member(&x, &xi);
                let v = zonotope(5, 0.05, &mut draws);
                let eta = vertex(5, &mut draws);
                let noise = member(&v, &eta);
                let seen: Vec<f64> = f_over(&mu, &truth)
                    .iter()
                    .zip(&noise)
                    .map(|(&m, &v)| (m + v).mid())
                    .collect();
                // y − V; what rounds in y is given to its box.
                let minus: Vec<f64> = seen.iter().zip(v.c()).map(|(y, c)| y - c).collect();
                let y = Zonotope::with_rounding(minus, v.g().scale(-1.0), vec![1e-12; n]).unwrap();
                let (x, y) = (
                    ConstrainedZonotope::from(x.clone()),
                    ConstrainedZonotope::from(y),
                );
                let by_mean_value = update_by_mean_value(
                    &mu,
                    &x,
                    &y,
                    recipe.jacobian,
                    recipe.vectors,
                    &mut LinearProgram::new(),
                )
                .unwrap();
                let bundle = update_bundle(
                    &mu,
                    &[x.zonotope().clone()],
                    &[y.zonotope().clone()],
                    recipe,
                );
                for set in [
                    &update(&mu, &x, &y, recipe).unwrap(),
                    &by_mean_value,
                    &bundle.unwrap()[0],
                ] {
                    holds(set, &truth);
                }
            }
        }
    }
}

/// x ↦ x² or x.
struct Power(bool);

impl Function for Power {
    fn inputs(&self) -> usize {
        1
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        out[0] = if self.0 { z[0].sqr() } else { z[0] };
    }
}

fn near(x: Interval, lo: f64, hi: f64) {
    assert!(x.lo() <= lo && x.hi() >= hi, "{x:?}");
    assert!(x.lo() > lo - 1e-9 && x.hi() < hi + 1e-9, "{x:?}");
}

#[test]
fn hand_examples() {
    // [0, 1] as { ξ₁ : ξ₁ − ξ₂ = 1 }: with J over the set but the corners of [−1, 1], x² would lose 0.
    let set = ConstrainedZonotope::new(
        vec![0.0],
        Matrix::from_rows(&[[1.0, 0.0]]).unwrap(),
        Matrix::from_rows(&[[1.0, -1.0]]).unwrap(),
        vec![1.0],
    )
    .unwrap();
    for recipe in [
        BEST,
        Recipe {
            choose: Choose::Argmin,
            ..ALL
        },
    ] {
        let image = &propagate(&Power(true), &set, recipe).unwrap()[0];
        for x in [0.0, 0.5, 1.0] {
            holds(image, &[Interval::point(x * x)]);
        }
    }
    // x² over [−1, 1]: lower has m = −2, g = x² + 2x ∈ [−1, 3]; upper the mirror image.
    let unit =
        ConstrainedZonotope::from_box(&IntervalVector::from_bounds(&[-1.0], &[1.0]).unwrap())
            .unwrap();
    let rows = generator_relations(&Power(true), &unit, ALL).unwrap();
    assert_eq!(rows[0].len(), 2);
    for (relation, m) in rows[0].iter().zip([-2.0, 2.0]) {
        assert!((relation.linear[0] - m).abs() < 1e-12, "{relation:?}");
    }
    for relation in &rows[0] {
        near(relation.remainder, -1.0, 3.0);
    }
    // Lemma 4: y = x = 1 is {1}; the printed right side gives {0}.
    let seen = ConstrainedZonotope::point(&[1.0]).unwrap();
    let updated = update(&Power(false), &unit, &seen, BEST).unwrap();
    near(updated.interval_hull().unwrap()[0], 1.0, 1.0);
    let mut lp = LinearProgram::new();
    let (j, v) = (JacobianBounds::Natural, Vectors::Paper);
    // Lemma 5: x² ∈ [0.75, 1] over [0, 1] about ½: ¼ + (x − ½) ± ½ must meet it, so x ∈ [½, 1].
    let upper =
        ConstrainedZonotope::from_box(&IntervalVector::from_bounds(&[0.0], &[1.0]).unwrap())
            .unwrap();
    let range = IntervalVector::from_bounds(&[0.75], &[1.0]).unwrap();
    let seen = ConstrainedZonotope::from_box(&range).unwrap();
    let updated = update_by_mean_value(&Power(true), &upper, &seen, j, v, &mut lp).unwrap();
    near(updated.interval_hull().unwrap()[0], 0.5, 1.0);
    // Rounding boxes count in full: [−1, 1] ± ½ through x, and a y of ± ¼ without a generator.
    let wide = Zonotope::with_rounding(vec![0.0], Matrix::identity(1), vec![0.5]).unwrap();
    let image = &propagate(&Power(false), &wide.into(), BEST).unwrap()[0];
    near(image.interval_hull().unwrap()[0], -1.5, 1.5);
    let seen = Zonotope::with_rounding(vec![0.0], Matrix::zeros(1, 0), vec![0.25]).unwrap();
    for set in [
        update(&Power(false), &unit, &seen.clone().into(), BEST).unwrap(),
        update_by_mean_value(&Power(false), &unit, &seen.into(), j, v, &mut lp).unwrap(),
    ] {
        near(set.interval_hull().unwrap()[0], -0.25, 0.25);
    }
    // What does not fit is refused.
    let two = ConstrainedZonotope::point(&[1.0, 1.0]).unwrap();
    assert!(update(&Power(true), &unit, &two, BEST).is_err());
    assert!(update_by_mean_value(&Power(true), &unit, &two, j, v, &mut lp).is_err());
}
