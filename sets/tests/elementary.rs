//! The elementary functions: values of 300 bits over the whole range, wide arguments, kinks and jumps, derivatives.

use serde_json::Value;
use zonobench_sets::number::{Dual, Interval, Real};

type One = (&'static str, fn(Interval) -> Interval, fn(f64) -> f64, i64);
type Two = (
    &'static str,
    fn(Interval, Interval) -> Interval,
    fn(f64, f64) -> f64,
    i64,
);

/// Name, over intervals, over f64, and how many steps libm may lie outside of the two f64s around the exact value: the
/// intervals are wider by two steps (four for the last four), so that two are left as a reserve.
const ONE: [One; 11] = [
    ("exp", Real::exp, Real::exp, 0),
    ("exp_m1", Real::exp_m1, Real::exp_m1, 0),
    ("ln", Real::ln, Real::ln, 0),
    ("log10", Real::log10, Real::log10, 0),
    ("ln_1p", Real::ln_1p, Real::ln_1p, 0),
    ("asin", Real::asin, Real::asin, 0),
    ("acos", Real::acos, Real::acos, 0),
    ("sinh", Real::sinh, Real::sinh, 2),
    ("cosh", Real::cosh, Real::cosh, 2),
    ("tanh", Real::tanh, Real::tanh, 2),
    ("asinh", Real::asinh, Real::asinh, 2),
];

const TWO: [Two; 3] = [
    ("atan2", Real::atan2, Real::atan2, 0),
    ("hypot", Real::hypot, Real::hypot, 0),
    ("pow", Real::pow, Real::pow, 0),
];

fn number(hexadecimal: &str) -> f64 {
    f64::from_bits(u64::from_str_radix(hexadecimal, 16).unwrap())
}

/// Steps from `a` to `b`, both finite.
fn steps(a: f64, b: f64) -> i64 {
    let place = |x: f64| {
        let bits = (x + 0.0).to_bits() as i64;
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    place(b) - place(a)
}

/// Checks the rows of `name`; returns how far libm lies outside of the f64s around the exact value, at worst.
fn check(
    table: &Value,
    name: &str,
    arguments: usize,
    eval: &dyn Fn(&[f64]) -> (Interval, f64),
) -> i64 {
    let rows = table["rows"][name].as_array().unwrap();
    assert!(rows.len() > 150, "{name}: {} rows", rows.len());
    let mut worst = 0;
    for row in rows {
        let fields: Vec<&str> = row.as_str().unwrap().split(' ').collect();
        let x: Vec<f64> = fields[..arguments].iter().map(|f| number(f)).collect();
        let floor = number(fields[arguments]);
        let ceiling = if fields[arguments + 1] == "1" {
            floor
        } else {
            floor.next_up()
        };
        let (enclosure, libm) = eval(&x);
        assert!(
            enclosure.lo() <= floor && ceiling <= enclosure.hi(),
            "{name} of {x:?}: {enclosure:?} loses a value in [{floor:e}, {ceiling:e}]"
        );
        if libm.is_finite() {
            worst = worst.max(steps(libm, floor)).max(steps(ceiling, libm));
        }
    }
    worst
}

#[test]
fn no_enclosure_loses_a_value_of_300_bits_and_libm_keeps_its_word() {
    let table: Value = serde_json::from_str(include_str!("reference/elementary.json")).unwrap();
    for (name, over, of, most) in ONE {
        let worst = check(&table, name, 1, &|x| {
            (over(Interval::point(x[0])), of(x[0]))
        });
        println!("{name}: libm at most {worst} steps outside of the f64s around the value");
        assert!(worst <= most, "{name}: {worst}");
    }
    for (name, over, of, most) in TWO {
        let worst = check(&table, name, 2, &|x| {
            (
                over(Interval::point(x[0]), Interval::point(x[1])),
                of(x[0], x[1]),
            )
        });
        println!("{name}: libm at most {worst} steps outside of the f64s around the value");
        assert!(worst <= most, "{name}: {worst}");
    }
}

/// Numbers by counter, uniform in [0, 1).
struct Draw(u64);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    fn interval(&mut self, a: f64, b: f64) -> Interval {
        let (x, y) = (self.between(a, b), self.between(a, b));
        Interval::new(if x < y { x } else { y }, if x < y { y } else { x }).unwrap()
    }

    fn inside(&mut self, x: Interval) -> f64 {
        self.between(x.lo(), x.hi()).clamp(x.lo(), x.hi())
    }
}

/// Where each function of one number is tried.
fn domain(name: &str) -> (f64, f64) {
    match name {
        "ln" | "log10" => (1e-3, 50.0),
        "ln_1p" => (-0.999, 20.0),
        "asin" | "acos" => (-1.0, 1.0),
        _ => (-20.0, 20.0),
    }
}

#[test]
fn a_wide_argument_holds_the_values_between_its_ends() {
    let mut draw = Draw(1);
    for (name, over, of, _) in ONE {
        let (a, b) = domain(name);
        for _ in 0..500 {
            let x = draw.interval(a, b);
            let y = over(x);
            for _ in 0..8 {
                let t = draw.inside(x);
                assert!(y.contains(of(t)), "{name} of {x:?} at {t:?}: {y:?}");
            }
        }
    }
    for (name, over, of, _) in TWO {
        for _ in 0..2000 {
            let (x, y) = match name {
                "pow" => (draw.interval(1e-3, 4.0), draw.interval(-5.0, 5.0)),
                _ => (draw.interval(-3.0, 3.0), draw.interval(-3.0, 3.0)),
            };
            let z = over(x, y);
            for _ in 0..8 {
                let (s, t) = (draw.inside(x), draw.inside(y));
                assert!(
                    z.contains(of(s, t)),
                    "{name} of {x:?}, {y:?} at {s:?}, {t:?}: {z:?}"
                );
            }
        }
    }
}

#[test]
fn integer_powers_contain_the_power_and_even_ones_have_their_least_value_inside() {
    let mut draw = Draw(2);
    for _ in 0..3000 {
        let x = draw.interval(-3.0, 3.0);
        let n = (draw.between(-9.0, 12.0)) as i32;
        let y = x.powi(n);
        let t = draw.inside(x);
        assert!(y.contains(Real::powi(t, n)), "{x:?} ^ {n} at {t:?}: {y:?}");
    }
    let x = Interval::new(-2.0, 1.0).unwrap();
    assert_eq!(x.powi(2), x.sqr());
    assert!(x.powi(4).lo() == 0.0 && (16.0..16.0 + 1e-13).contains(&x.powi(4).hi()));
    assert!(x.powi(3).contains(-8.0) && x.powi(3).lo() > -8.0 - 1e-13);
    assert_eq!(x.powi(0), Interval::ONE);
    assert_eq!(x.powi(1), x);
    assert!(x.powi(-1).is_entire() && x.powi(i32::MIN).is_entire());
    // 1.5^(-2³¹) underflows, 1.5^(2³¹ − 1) overflows.
    let far = Interval::point(1.5);
    assert!(far.powi(i32::MIN).lo() == 0.0 && far.powi(i32::MIN).hi() > 0.0);
    assert!(far.powi(i32::MAX).hi() == f64::INFINITY && far.powi(i32::MAX).lo().is_finite());
}

#[test]
fn outside_of_its_domain_a_function_is_the_whole_line() {
    let iv = |lo, hi| Interval::new(lo, hi).unwrap();
    for wrong in [
        iv(0.0, 1.0).ln(),
        iv(-1.0, 2.0).log10(),
        iv(-1.0, 2.0).ln_1p(),
        iv(-1.0, 1.0_f64.next_up()).asin(),
        iv(-2.0, 0.0).acos(),
        iv(-0.1, 1.0).powf(0.5),
        iv(0.0, 1.0).powf(-0.5),
        Interval::ENTIRE.ln(),
    ] {
        assert!(wrong.is_entire());
    }
    assert_eq!(iv(0.0, 0.25).powf(0.5).lo(), 0.0);
    assert_eq!(Interval::ONE.ln(), Interval::ZERO);
    assert_eq!(Interval::ZERO.exp(), Interval::ONE);
    assert_eq!(Interval::ONE.acos(), Interval::ZERO);
    assert!(f64::NAN.min(1.0).is_finite(), "std's, which forgets a NaN");
    assert!(Real::min(f64::NAN, 1.0).is_nan() && Real::max(f64::NAN, 1.0).is_nan());
}

#[test]
fn the_angle_jumps_at_the_negative_axis_and_nowhere_else() {
    let iv = |lo, hi| Interval::new(lo, hi).unwrap();
    let all = iv(-1.0, 1.0).atan2(iv(-2.0, -1.0));
    assert!(all.contains(std::f64::consts::PI) && all.contains(-std::f64::consts::PI));
    let right = iv(-1.0, 1.0).atan2(iv(1.0, 2.0));
    assert!(right.hi() < 0.79 && right.lo() > -0.79, "{right:?}");
    let above = iv(1.0, 2.0).atan2(iv(-1.0, 1.0));
    assert!(
        above.lo() < 0.79 && above.hi() > 2.356 && above.hi() < 2.357,
        "{above:?}"
    );
    // The derivative says that a mean value form across the jump is none.
    let slope = |y, x| Dual::<_, 1>::variable(y, 0).atan2(Dual::fixed(x)).gradient[0];
    assert!(slope(iv(-1.0, 1.0), iv(-2.0, -1.0)).is_entire());
    assert!(slope(iv(-1.0, 1.0), iv(1.0, 2.0)).is_finite());
    // The second derivative too.
    let second = |y: Interval, x: Interval| {
        let y = Dual::<Dual<Interval, 1>, 1>::variable(Dual::variable(y, 0), 0);
        y.atan2(Dual::fixed(Dual::fixed(x))).gradient[0].gradient[0]
    };
    assert!(!second(iv(-1.0, 1.0), iv(-2.0, -1.0)).is_finite());
    assert!(second(iv(-1.0, 1.0), iv(1.0, 2.0)).is_finite());
}

#[test]
fn at_a_kink_the_first_derivative_is_the_hull_of_both_and_there_is_no_second() {
    let iv = |lo, hi| Interval::new(lo, hi).unwrap();
    type D = Dual<Interval, 1>;
    type DD = Dual<Dual<Interval, 1>, 1>;
    let second = |f: fn(DD) -> DD, x: Interval| {
        f(DD::variable(D::variable(x, 0), 0)).gradient[0].gradient[0]
    };
    // Up to the step outward of a product.
    let about = |x: Interval, y: Interval| {
        x.contains_interval(y) && steps(x.lo(), y.lo()) <= 1 && steps(y.hi(), x.hi()) <= 1
    };
    assert!(about(
        D::variable(iv(-1.0, 2.0), 0).abs().gradient[0],
        Interval::UNIT
    ));
    assert!(about(
        D::variable(iv(1.0, 2.0), 0).abs().gradient[0],
        Interval::ONE
    ));
    assert!(about(
        D::variable(iv(-2.0, -1.0), 0).abs().gradient[0],
        -Interval::ONE
    ));
    assert!(second(Real::abs, iv(-1.0, 2.0)).is_entire());
    assert_eq!(second(Real::abs, iv(1.0, 2.0)), Interval::ZERO);
    // min(x, x²): the parabola below 1 is smaller.
    let least = |x: D| x.min(x.sqr());
    assert_eq!(
        least(D::variable(iv(2.0, 3.0), 0)).gradient[0],
        Interval::ONE
    );
    assert!(least(D::variable(iv(0.5, 2.0), 0)).gradient[0].contains_interval(iv(1.0, 4.0)));
    let twice = |x: DD| x.min(x.sqr());
    assert!(!second(twice, iv(0.5, 2.0)).is_finite());
    assert_eq!(second(twice, iv(2.0, 3.0)), Interval::ZERO);
    let most = |x: D| x.max(x.sqr());
    assert!(most(D::variable(iv(2.0, 3.0), 0)).gradient[0].contains_interval(iv(4.0, 6.0)));
}

/// Every function of one number, generic over the number.
fn every<S: Real>(x: S) -> Vec<(&'static str, S)> {
    let inner = x * 0.04;
    vec![
        ("exp", x.exp()),
        ("exp_m1", x.exp_m1()),
        ("ln", (x.sqr() + 1.0).ln()),
        ("log10", (x.sqr() + 1.0).log10()),
        ("ln_1p", x.sqr().ln_1p()),
        ("powi", x.powi(5)),
        ("powi of a quotient", (x.sqr() + 1.0).powi(-3)),
        ("powf", (x.sqr() + 1.0).powf(1.7)),
        ("pow", (x.sqr() + 1.0).pow(inner + 0.5)),
        ("asin", inner.asin()),
        ("acos", inner.acos()),
        ("atan2", x.atan2(x.sqr() + 1.0)),
        ("sinh", x.sinh()),
        ("cosh", x.cosh()),
        ("tanh", x.tanh()),
        ("asinh", x.asinh()),
        ("hypot", x.hypot(x.sqr() + 1.0)),
        ("abs", (x.sqr() + 1.0).abs()),
        ("min", x.min(x.sqr() + 1.0)),
        ("max", x.max(-x.sqr() - 1.0)),
    ]
}

#[test]
fn derivatives_are_the_slopes_and_over_a_box_they_hold_those_of_its_points() {
    let mut draw = Draw(3);
    for _ in 0..300 {
        let x = draw.interval(-3.0, 3.0);
        let t = draw.inside(x);
        let at_point = every(Dual::<Dual<f64, 1>, 1>::variable(Dual::variable(t, 0), 0));
        let over_box = every(Dual::<Dual<Interval, 1>, 1>::variable(
            Dual::variable(x, 0),
            0,
        ));
        let h = 1e-5;
        let (before, after) = (every(t - h), every(t + h));
        for (i, (name, point)) in at_point.iter().enumerate() {
            let (slope, curvature) = (point.gradient[0].value, point.gradient[0].gradient[0]);
            let quotient = (after[i].1 - before[i].1) / (2.0 * h);
            // A difference quotient errs by h² times the third derivative, and by rounding over h: 1e-6 of values up to e³.
            let scale = 1.0 + slope.abs() + point.value.value.abs();
            assert!(
                (slope - quotient).abs() < 1e-6 * scale,
                "{name} at {t}: {slope} {quotient}"
            );
            let box_ = &over_box[i].1;
            for (what, wide, value) in [
                ("value", box_.value.value, point.value.value),
                ("slope", box_.gradient[0].value, slope),
                ("curvature", box_.gradient[0].gradient[0], curvature),
            ] {
                // The f64 value errs by a few roundings of its terms.
                let slack = 1e-12 * (1.0 + value.abs());
                let held = wide.lo() - slack <= value && value <= wide.hi() + slack;
                assert!(held, "{name} over {x:?} at {t}: {what} {wide:?} {value}");
            }
        }
    }
}
