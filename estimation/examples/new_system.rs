//! A new system: a cart with quadratic drag, of which the position is measured.

use zonobench_estimation::System;
use zonobench_estimation::system::{Variable, Variables};
use zonobench_sets::Interval;
use zonobench_sets::number::Real;

/// p⁺ = p + T s, s⁺ = s + T (u − d s²) + w, y = p + v: position p, speed s, force u a unit of mass.
struct Cart {
    /// T, the sampling period in s
    dt: f64,
    /// d, the drag in 1/m
    drag: f64,
}

impl System for Cart {
    fn variables(&self) -> Variables {
        Variables {
            x: vec![Variable::new("p", "m"), Variable::new("s", "m/s")],
            u: vec![Variable::new("force", "m/s2")],
            w: vec![Variable::new("w", "m/s")],
            y: vec![Variable::new("y", "m")],
            v: vec![Variable::new("v", "m")],
        }
    }

    // Once for every number: plain for the simulator, intervals for the set estimators. No branch on a state, and
    // `sqr`, not a product of a variable with itself: intervals are wider for every repeat.
    fn f<S: Real>(&self, _k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        next[0] = x[0] + x[1] * self.dt;
        next[1] = x[1] + (S::constant(u[0]) - x[1].sqr() * self.drag) * self.dt + w[0];
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        y[0] = x[0] + v[0];
    }
}

/// Drives the cart for 100 steps and checks the law of `System`: on intervals, `f` contains every point.
pub fn main() {
    let cart = Cart {
        dt: 0.1,
        drag: 0.05,
    };
    let mut x = vec![0.0, 0.0];
    for k in 0..100 {
        let w = if k % 7 < 3 { 0.02 } else { -0.02 };
        let mut next = vec![0.0; 2];
        cart.f(k, &x, &[2.0], &[w], &mut next);
        let sides: Vec<Interval> = x
            .iter()
            .map(|x| Interval::from_center_radius(*x, 0.1))
            .collect();
        let mut enclosure = vec![Interval::from_center_radius(0.0, 0.0); 2];
        cart.f(
            k,
            &sides,
            &[2.0],
            &[Interval::from_center_radius(0.0, 0.02)],
            &mut enclosure,
        );
        assert!(
            enclosure
                .iter()
                .zip(&next)
                .all(|(side, x)| side.contains(*x)),
            "k = {k}"
        );
        x = next;
    }
    // Drag and force balance at s = √(u / d).
    assert!((x[1] - (2.0_f64 / 0.05).sqrt()).abs() < 0.5, "{x:?}");
    println!("after 100 steps at {:.2} m with {:.2} m/s", x[0], x[1]);
}
