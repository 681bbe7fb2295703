//! Intervals, duals, boxes and interval matrices against exact arithmetic.

#![allow(clippy::disallowed_methods)] // the platform's functions stand here as a second opinion

mod fixed_point;

use fixed_point::{
    PRODUCT, SERIES, SERIES_ERROR, SUM, Source, arctan, encloses, error_in_ulps, fixed, half_pi,
    is_above, is_below, quarter, rational, sin_cos,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use proptest::prelude::*;
use zonobench_sets::interval_matrix::{hessian_over, jacobian_over};
use zonobench_sets::number::{Function, hessian, jacobian};
use zonobench_sets::rounding::{ETA, U, gamma, up};
use zonobench_sets::{Dual, Interval, IntervalMatrix, IntervalVector, Matrix, Real, SetError};

fn iv(lo: f64, hi: f64) -> Interval {
    Interval::new(lo, hi).unwrap()
}

fn extremes(values: impl IntoIterator<Item = BigInt>) -> (BigInt, BigInt) {
    let values: Vec<BigInt> = values.into_iter().collect();
    (
        values.iter().min().unwrap().clone(),
        values.iter().max().unwrap().clone(),
    )
}

fn ends(x: Interval, scale: usize) -> [BigInt; 2] {
    [fixed(x.lo(), scale), fixed(x.hi(), scale)]
}

/// The largest distance in f64 steps that a bound may have from the exact one.
fn is_tight(x: Interval, lo: &BigInt, hi: &BigInt, scale: usize, steps: usize) -> bool {
    let inner_lo = (0..steps).fold(x.lo(), |b, _| b.next_up());
    let inner_hi = (0..steps).fold(x.hi(), |b, _| b.next_down());
    (inner_lo == f64::INFINITY || !is_below(inner_lo.next_up(), lo, scale))
        && (inner_hi == f64::NEG_INFINITY || !is_above(inner_hi.next_down(), hi, scale))
}

#[test]
fn sums_and_differences_have_the_best_bounds_there_are() {
    let mut source = Source(1);
    for _ in 0..40_000 {
        let a = source.interval();
        let b = source.partner(a);
        for (result, b) in [(a + b, b), (a - (-b), b), (a - b, -b)] {
            let ([al, ah], [bl, bh]) = (ends(a, SUM), ends(b, SUM));
            let (lo, hi) = (al + bl, ah + bh);
            assert!(
                is_below(result.lo(), &lo, SUM) && is_above(result.hi(), &hi, SUM),
                "{a:?} {b:?} {result:?}"
            );
            assert!(is_tight(result, &lo, &hi, SUM, 0), "{a:?} {b:?} {result:?}");
        }
    }
}

#[test]
fn products_and_squares_contain_the_exact_ones() {
    let mut source = Source(2);
    for _ in 0..20_000 {
        let a = source.interval();
        let b = source.partner(a);
        let result = a * b;
        let (x, y) = (ends(a, SUM), ends(b, SUM));
        let (lo, hi) = extremes([&x[0] * &y[0], &x[0] * &y[1], &x[1] * &y[0], &x[1] * &y[1]]);
        assert!(
            is_below(result.lo(), &lo, PRODUCT) && is_above(result.hi(), &hi, PRODUCT),
            "{a:?} {b:?} {result:?}"
        );
        assert!(
            is_tight(result, &lo, &hi, PRODUCT, 1),
            "{a:?} {b:?} {result:?}"
        );

        let square = a.sqr();
        let (mut lo, hi) = extremes([&x[0] * &x[0], &x[1] * &x[1]]);
        if a.contains(0.0) {
            lo = BigInt::zero();
        }
        assert!(square.lo() >= 0.0);
        assert!(
            is_below(square.lo(), &lo, PRODUCT) && is_above(square.hi(), &hi, PRODUCT),
            "{a:?} {square:?}"
        );
        assert!(is_tight(square, &lo, &hi, PRODUCT, 1), "{a:?} {square:?}");
    }
}

#[test]
fn products_and_quotients_with_a_number_contain_the_exact_ones() {
    let mut source = Source(3);
    for i in 0..20_000 {
        let a = source.interval();
        let s = if i % 2 == 0 {
            source.adversarial()
        } else {
            let sign = if source.below(2) == 0 { 1.0 } else { -1.0 };
            sign * f64::from_bits(source.below(0x7ff) << 52)
        };
        let (x, s_exact) = (ends(a, SUM), fixed(s, SUM));
        let (lo, hi) = extremes([&x[0] * &s_exact, &x[1] * &s_exact]);
        let result = a * s;
        assert!(
            is_below(result.lo(), &lo, PRODUCT) && is_above(result.hi(), &hi, PRODUCT),
            "{a:?} {s:?} {result:?}"
        );
        assert_eq!(s * a, result);
        check_quotient(a, Interval::point(s), a / s);
    }
}

/// q ≤ a/b for b ≠ 0, all at 2^−1074, decided without dividing.
fn quotient_order(q: &BigInt, a: &BigInt, b: &BigInt) -> std::cmp::Ordering {
    let order = (q * b).cmp(&(a << SUM));
    if b.is_negative() {
        order.reverse()
    } else {
        order
    }
}

fn check_quotient(a: Interval, b: Interval, result: Interval) {
    if b.contains(0.0) {
        assert!(result.is_entire(), "{a:?} / {b:?} = {result:?}");
        return;
    }
    let mut near = [false; 2];
    for x in ends(a, SUM) {
        for y in ends(b, SUM) {
            let compare = |q: f64| quotient_order(&fixed(q, SUM), &x, &y);
            assert!(
                result.lo() == f64::NEG_INFINITY || compare(result.lo()).is_le(),
                "{a:?} / {b:?} = {result:?}"
            );
            assert!(
                result.hi() == f64::INFINITY || compare(result.hi()).is_ge(),
                "{a:?} / {b:?} = {result:?}"
            );
            let inner_lo = result.lo().next_up().next_up();
            let inner_hi = result.hi().next_down().next_down();
            near[0] |= !inner_lo.is_finite() || compare(inner_lo).is_ge();
            near[1] |= !inner_hi.is_finite() || compare(inner_hi).is_le();
        }
    }
    assert!(
        near[0] && near[1],
        "{a:?} / {b:?} = {result:?} is wider than two steps"
    );
}

#[test]
fn quotients_contain_the_exact_ones() {
    let mut source = Source(4);
    let mut divided = 0;
    for _ in 0..20_000 {
        let a = source.interval();
        let b = source.partner(a);
        check_quotient(a, b, a / b);
        check_quotient(Interval::ONE, b, b.recip());
        divided += usize::from(!b.contains(0.0));
    }
    assert!(divided > 5_000, "{divided} divisors without 0");
}

#[test]
fn roots_contain_the_exact_ones() {
    let mut source = Source(5);
    let mut taken = 0;
    for _ in 0..20_000 {
        let a = source.interval();
        let result = a.sqrt();
        if a.lo() < 0.0 {
            assert!(result.is_entire());
            continue;
        }
        taken += 1;
        assert!(result.lo() >= 0.0);
        // lo ≤ √a is lo² ≤ a.
        let square = |x: f64| fixed(x, SUM) * fixed(x, SUM);
        let ([lo, hi], [low, high]) = (ends(a, PRODUCT), [result.lo(), result.hi()]);
        assert!(square(low) <= lo && square(high) >= hi, "{a:?} {result:?}");
        let next = low.next_up().next_up();
        assert!(square(next) >= lo, "{a:?} {result:?}");
        let previous = high.next_down().next_down();
        assert!(
            previous <= 0.0 || square(previous) <= hi,
            "{a:?} {result:?}"
        );
    }
    assert!(taken > 3_000, "{taken} arguments without a negative part");
}

#[test]
fn what_is_exact_is_not_widened() {
    let x = iv(0.1, 0.3);
    assert_eq!(x + Interval::ZERO, x);
    assert_eq!(x - 0.0, x);
    assert_eq!(x * Interval::ZERO, Interval::ZERO);
    assert_eq!(x * 0.0, Interval::ZERO);
    assert_eq!(Interval::ZERO / x, Interval::ZERO);
    assert_eq!(Interval::ZERO.sqr(), Interval::ZERO);
    assert_eq!(Interval::ZERO.sqrt(), Interval::ZERO);
    assert_eq!(Interval::ZERO.sin(), Interval::ZERO);
    assert_eq!(Interval::ZERO.tan(), Interval::ZERO);
    assert_eq!(Interval::ZERO.atan(), Interval::ZERO);
    assert_eq!(Interval::ZERO.cos(), Interval::ONE);
    assert_eq!(x * 2.0, iv(0.2, 0.6));
    assert_eq!(x / -4.0, iv(-0.075, -0.025));
    assert_eq!(iv(1.0, 2.0) + iv(3.0, 5.0), iv(4.0, 7.0));
    assert_eq!(iv(0.0, 1.0) * iv(0.0, 1.0), iv(0.0, 1.0f64.next_up()));
}

#[test]
fn a_product_that_underflows_is_widened() {
    let tiny = f64::from_bits(1);
    let x = Interval::point(1e-200);
    assert_eq!(x * x, iv(0.0, tiny));
    assert_eq!(-x * x, iv(-tiny, 0.0));
    assert_eq!(x.sqr(), iv(0.0, tiny));
    assert_eq!(x * -1e-200, iv(-tiny, 0.0));
    assert_eq!(x / 1e200, iv(0.0, tiny));
    assert_eq!(-x / Interval::point(1e200), iv(-tiny, 0.0));
    assert_eq!(Interval::point(tiny) * 0.5, iv(0.0, tiny));
}

#[test]
fn outside_the_domain_is_the_whole_line() {
    let x = iv(1.0, 2.0);
    for zero in [
        Interval::ZERO,
        iv(0.0, 1.0),
        iv(-1.0, 0.0),
        iv(-1.0, 1.0),
        Interval::ENTIRE,
    ] {
        assert!((x / zero).is_entire());
        assert!(zero.recip().is_entire());
        assert!((Interval::ZERO / zero).is_entire());
    }
    assert!(iv(-1e-300, 4.0).sqrt().is_entire());
    assert!(iv(-3.0, -2.0).sqrt().is_entire());
    assert!(iv(1.0, 2.0).tan().is_entire());
    assert!(iv(0.0, 4.0).tan().is_entire());
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(Interval::point(x).is_entire());
        assert!((iv(1.0, 2.0) + x).is_entire() && (iv(1.0, 2.0) / x).is_entire());
        assert!(Interval::constant(x).is_entire());
        assert!(Interval::from_center_radius(x, 1.0).is_entire());
        assert!(matches!(
            Interval::new(x, x),
            Err(SetError::NotFinite { .. })
        ));
    }
    assert!(matches!(
        Interval::new(2.0, 1.0),
        Err(SetError::Reversed { .. })
    ));
    assert_eq!(
        (x / Interval::ZERO).finite("division"),
        Err(SetError::Domain {
            op: "division",
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY
        })
    );
}

#[test]
fn arithmetic_of_unbounded_intervals_makes_no_nan() {
    let huge = Interval::point(f64::MAX);
    let above = huge + huge;
    assert_eq!((above.lo(), above.hi()), (f64::MAX, f64::INFINITY));
    let (entire, zero) = (Interval::ENTIRE, Interval::ZERO);
    assert_eq!(entire * zero, zero);
    assert_eq!(above * zero, zero);
    assert_eq!(zero / above, zero);
    assert_eq!((Interval::ONE / above).lo(), 0.0);
    assert!((above - above).is_entire());
    let sample = [
        zero,
        entire,
        above,
        -above,
        iv(-1.0, 2.0),
        iv(0.0, 1.0),
        iv(-1.0, 0.0),
        huge,
        iv(3.0, 4.0),
    ];
    for a in sample {
        for b in sample {
            for r in [
                a + b,
                a - b,
                a * b,
                a / b,
                a.hull(&b),
                a * 3.0,
                a * 2.0,
                a / 2.0,
            ] {
                assert!(
                    r.lo() <= r.hi() && r.lo() < f64::INFINITY && r.hi() > f64::NEG_INFINITY,
                    "{a:?} {b:?} {r:?}"
                );
            }
        }
        for r in [
            -a,
            a.sqr(),
            a.sqrt(),
            a.recip(),
            a.sin(),
            a.cos(),
            a.tan(),
            a.atan(),
            a.abs(),
        ] {
            assert!(
                r.lo() <= r.hi() && r.lo() < f64::INFINITY && r.hi() > f64::NEG_INFINITY,
                "{a:?} {r:?}"
            );
        }
        assert!(
            a.contains(a.mid()) && a.mid().is_finite(),
            "{a:?} {}",
            a.mid()
        );
    }
}

#[test]
fn mid_and_rad_cover_the_interval() {
    let mut source = Source(6);
    for _ in 0..40_000 {
        let x = source.interval();
        let (mid, rad) = (x.mid(), x.rad());
        assert!(x.contains(mid));
        let [lo, hi] = ends(x, SUM);
        let m = fixed(mid, SUM);
        assert!(
            is_above(rad, &(&hi - &m), SUM) && is_above(rad, &(&m - &lo), SUM),
            "{x:?}"
        );
        assert!(is_above(x.width(), &(&hi - &lo), SUM), "{x:?}");
        assert!(
            rad == f64::INFINITY || Interval::from_center_radius(mid, rad).contains_interval(x),
            "{x:?}"
        );
        assert_eq!(x.rad() == 0.0, x.is_point());
        assert_eq!(x.mag(), x.lo().abs().max(x.hi().abs()));
        assert_eq!(x.mig() == 0.0, x.contains(0.0));
    }
}

/// Arguments where an elementary function is hard: near multiples of π/2, tiny, ordinary.
fn angle(source: &mut Source) -> f64 {
    let steps = source.below(5) as i64 - 2;
    let shift = |x: f64| f64::from_bits((x.to_bits() as i64 + steps) as u64);
    match source.below(6) {
        0 => shift((1 + source.below(8)) as f64 * std::f64::consts::FRAC_PI_2),
        1 => shift((1 + source.below(600_000)) as f64 * std::f64::consts::FRAC_PI_2),
        2 => source.scaled(20),
        3 => source.signed() * 1e-300,
        4 => source.scaled(600).clamp(-1e6, 1e6),
        _ => 4.0 * source.signed(),
    }
}

#[test]
fn sin_cos_and_tan_contain_the_exact_values() {
    let half_pi = half_pi();
    let error = BigInt::from(SERIES_ERROR);
    let mut source = Source(7);
    let mut worst = [0.0f64; 3];
    for _ in 0..4_000 {
        let x = angle(&mut source);
        let (s, c) = sin_cos(x, &half_pi);
        for (result, value) in [
            (Interval::point(x).sin(), &s),
            (Interval::point(x).cos(), &c),
        ] {
            assert!(
                encloses(result, &(value - &error), SERIES)
                    && encloses(result, &(value + &error), SERIES)
                    || result.hi() == 1.0 && is_below(result.lo(), &(value - &error), SERIES)
                    || result.lo() == -1.0 && is_above(result.hi(), &(value + &error), SERIES),
                "{x:?} {result:?}"
            );
            assert!(
                result.width() <= 5.0 * f64::EPSILON * result.mag(),
                "{x:?} {result:?}"
            );
            assert!(-1.0 <= result.lo() && result.hi() <= 1.0);
        }
        worst[0] = worst[0].max(if x == 0.0 {
            0.0
        } else {
            error_in_ulps(libm::sin(x), &s)
        });
        worst[1] = worst[1].max(error_in_ulps(libm::cos(x), &c));

        let tangent = Interval::point(x).tan();
        if tangent.is_entire() {
            assert!(
                c.abs() < BigInt::from(1) << (SERIES - 25),
                "{x:?} is near a pole"
            );
            continue;
        }
        // t·c ≤ s (c > 0) decides t ≤ tan x; the errors of s and c weigh at most error·(1 + |t|).
        let compare = |t: f64| {
            let sign = if c.is_negative() { -1 } else { 1 };
            let t = fixed(t, SERIES);
            let magnitude: BigInt = t.abs() >> SERIES;
            let slack: BigInt = &error * (magnitude + 2);
            (sign * (((&t * &c) >> SERIES) - &s), slack)
        };
        let ((low, low_slack), (high, high_slack)) = (compare(tangent.lo()), compare(tangent.hi()));
        assert!(
            x == 0.0 || low <= -low_slack && high >= high_slack,
            "{x:?} {tangent:?}"
        );
        assert!(
            tangent.width() <= 5.0 * f64::EPSILON * tangent.mag(),
            "{x:?} {tangent:?}"
        );
        if x != 0.0 {
            let t = (&s << SERIES) / &c;
            worst[2] = worst[2].max(error_in_ulps(libm::tan(x), &t));
        }
    }
    assert!(
        worst.iter().all(|&w| w < 1.0),
        "libm's errors in units of the last place: {worst:?}"
    );
}

#[test]
fn arctan_contains_the_exact_values() {
    let half_pi = half_pi();
    let error = BigInt::from(SERIES_ERROR);
    let mut source = Source(8);
    let mut worst = 0.0f64;
    for i in 0..3_000 {
        let x = match i % 4 {
            0 => source.scaled(900),
            1 => source.scaled(4),
            2 => {
                // libm changes its formula at these.
                let switch = [
                    0.4375,
                    0.6875,
                    1.1875,
                    2.4375,
                    7.888_609_052_210_118e-31,
                    7.378_697_629_483_821e19,
                ];
                let x: f64 = switch[source.below(6) as usize];
                f64::from_bits(x.to_bits() - 2 + source.below(5))
            }
            _ => source.scaled(60),
        };
        let exact = arctan(x, &half_pi);
        let result = Interval::point(x).atan();
        assert!(
            encloses(result, &(&exact - &error), SERIES)
                && encloses(result, &(&exact + &error), SERIES),
            "{x:?} {result:?}"
        );
        assert!(
            result.width() <= 5.0 * f64::EPSILON * result.mag(),
            "{x:?} {result:?}"
        );
        worst = worst.max(error_in_ulps(libm::atan(x), &exact));
    }
    assert!(
        worst < 1.0,
        "libm's error in units of the last place: {worst}"
    );
}

#[test]
fn the_series_know_the_classical_values() {
    let half_pi = half_pi();
    let close = |a: &BigInt, b: &BigInt| (a - b).abs() < BigInt::from(SERIES_ERROR);
    // arctan 1 = π/4, and sin² + cos² = 1.
    assert!(close(&(2 * arctan(1.0, &half_pi)), &half_pi));
    assert_eq!(
        fixed(std::f64::consts::FRAC_PI_2, SERIES) >> (SERIES - 51),
        &half_pi >> (SERIES - 51)
    );
    for x in [0.5, -3.0, 100.25, 1e6] {
        let (s, c) = sin_cos(x, &half_pi);
        assert!(close(
            &((&s * &s + &c * &c) >> SERIES),
            &(BigInt::from(1) << SERIES)
        ));
        let rounded = (fixed(f64::sin(x), SERIES) - s).abs();
        assert!(rounded < BigInt::from(1) << (SERIES - 51), "{x}");
    }
}

#[test]
fn waves_over_wide_intervals_contain_all_their_values() {
    let half_pi = half_pi();
    let mut source = Source(9);
    for _ in 0..3_000 {
        let a = angle(&mut source);
        let b = if source.below(3) == 0 {
            angle(&mut source)
        } else {
            a + 4.0 * source.uniform()
        };
        let x = iv(a.min(b), a.max(b));
        let (sin, cos) = (x.sin(), x.cos());
        // The extrema at the multiples n·π/2 that lie inside, from exact division.
        let [lo, hi] = ends(x, SERIES);
        let first: BigInt = &lo / &half_pi - 1;
        for n in (0..12).map(|i| &first + i) {
            let inside = lo <= &n * &half_pi && &n * &half_pi <= hi;
            let bounds = [cos.hi(), sin.hi(), -cos.lo(), -sin.lo()];
            if inside {
                assert_eq!(
                    bounds[quarter(&n)],
                    1.0,
                    "{x:?} holds {n}·π/2: {sin:?} {cos:?}"
                );
            }
        }
        for _ in 0..3 {
            let t = source.within(x);
            let (s, c) = sin_cos(t, &half_pi);
            assert!(
                encloses(sin, &s, SERIES) && encloses(cos, &c, SERIES),
                "{x:?} at {t:?}: {sin:?} {cos:?}"
            );
            let tan = x.tan();
            assert!(
                tan.is_entire() || encloses(tan, &((&s << SERIES) / &c), SERIES),
                "{x:?} at {t:?}: {tan:?}"
            );
        }
    }
    assert_eq!(iv(2e6, 2e6).sin(), Interval::UNIT);
    assert_eq!(Interval::ENTIRE.cos(), Interval::UNIT);
    assert!(iv(2e6, 2e6).tan().is_entire());
    assert!(iv(0.1, 0.2).sin().width() < 0.1);
    assert!(iv(-1.5, 1.5).tan().hi() < 14.2);
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        2 => prop::num::f64::NORMAL.prop_filter("finite", |x| x.is_finite()),
        1 => prop::num::f64::SUBNORMAL,
        1 => Just(0.0),
        1 => Just(f64::MAX),
        1 => (-8i32..8).prop_map(f64::from),
    ]
}

/// An interval and one inside it.
fn nested() -> impl Strategy<Value = (Interval, Interval)> {
    [finite(), finite(), finite(), finite()].prop_map(|mut b| {
        b.sort_by(f64::total_cmp);
        (iv(b[0], b[3]), iv(b[1], b[2]))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arithmetic_is_inclusion_isotonic((a, a_in) in nested(), (b, b_in) in nested(), s in finite()) {
        let pairs = [
            (a + b, a_in + b_in),
            (a - b, a_in - b_in),
            (a * b, a_in * b_in),
            (a / b, a_in / b_in),
            (a * s, a_in * s),
            (a / s, a_in / s),
            (a.sqr(), a_in.sqr()),
            (a.sqrt(), a_in.sqrt()),
            (a.recip(), a_in.recip()),
            (a.abs(), a_in.abs()),
            (a.hull(&b), a_in.hull(&b_in)),
        ];
        for (i, (outer, inner)) in pairs.into_iter().enumerate() {
            prop_assert!(outer.contains_interval(inner), "operation {i}: {a:?} {a_in:?} {b:?} {b_in:?}: {outer:?} {inner:?}");
        }
        // Elementary functions: up to libm's own error, which the two steps cover once more.
        let steps = |x: Interval| {
            let (lo, hi) = ((0..4).fold(x.lo(), |l, _| l.next_down()), (0..4).fold(x.hi(), |h, _| h.next_up()));
            (lo, hi)
        };
        let pairs = [(a.sin(), a_in.sin()), (a.cos(), a_in.cos()), (a.tan(), a_in.tan()), (a.atan(), a_in.atan())];
        for (outer, inner) in pairs {
            let (lo, hi) = steps(outer);
            prop_assert!(lo <= inner.lo() && inner.hi() <= hi, "{a:?} {a_in:?}: {outer:?} {inner:?}");
        }
    }

    #[test]
    fn intersection_and_hull_are_the_sets((a, a_in) in nested(), (b, _) in nested(), x in finite()) {
        let meet = a.intersect(&b);
        prop_assert_eq!(meet.is_some_and(|m| m.contains(x)), a.contains(x) && b.contains(x));
        prop_assert!(a.hull(&b).contains_interval(a) && a.hull(&b).contains_interval(b));
        prop_assert!(a_in.is_subset(a) && a.intersect(&a_in) == Some(a_in));
        let text = serde_json::to_string(&a).unwrap();
        prop_assert_eq!(serde_json::from_str::<Interval>(&text).unwrap(), a);
    }
}

/// f₁ = 3 x₁ − x₁²/7 − 4 x₁ x₂/(4 + x₁) of [Rego2020, Eq. (23)] without noise, in three forms.
#[derive(Clone, Copy)]
enum Growth {
    /// x₁ x₂/(4 + x₁).
    Quotient,
    /// x₁ x₂ · (4 + x₁)⁻¹.
    Reciprocal,
    /// x₂ − 4 x₂ · (4 + x₁)⁻¹.
    Once,
}

impl Function for Growth {
    fn inputs(&self) -> usize {
        2
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        let fraction = match self {
            Self::Quotient => x[0] * x[1] / (x[0] + 4.0),
            Self::Reciprocal => x[0] * x[1] * (x[0] + 4.0).recip(),
            Self::Once => x[1] - x[1] * (x[0] + 4.0).recip() * 4.0,
        };
        y[0] = x[0] * 3.0 - x[0].sqr() / 7.0 - fraction * 4.0;
    }
}

fn near(x: Interval, lo: f64, hi: f64) {
    assert!(
        (x.lo() - lo).abs() < 6e-6 && (x.hi() - hi).abs() < 6e-6,
        "{x:?} is not [{lo}, {hi}]"
    );
}

#[test]
fn the_form_of_a_model_decides_its_enclosure() {
    let x = IntervalVector::from_bounds(&[2.0, 0.9], &[2.4, 1.1]).unwrap();
    let (_, twice) = jacobian_over(&Growth::Quotient, &x).unwrap();
    near(twice[(0, 0)], 1.76845, 2.14107);
    near(twice[(0, 1)], -1.6, -1.25);
    let (_, once) = jacobian_over(&Growth::Once, &x).unwrap();
    // 3 − 2x₁/7 − 16x₂/(4 + x₁)² and −4 + 16/(4 + x₁), each variable once a term.
    near(
        once[(0, 0)],
        3.0 - 4.8 / 7.0 - 17.6 / 36.0,
        3.0 - 4.0 / 7.0 - 14.4 / 40.96,
    );
    near(once[(0, 1)], -1.5, -4.0 / 3.0);
    for form in [Growth::Quotient, Growth::Reciprocal, Growth::Once] {
        let (_, first, second) = hessian_over(&form, &x).unwrap();
        assert_eq!(second[0][(1, 1)], Interval::ZERO);
        assert_eq!(second[0][(0, 1)], second[0][(1, 0)]);
        for i in 0..=40 {
            for j in 0..=40 {
                let (a, b) = (2.0 + 0.01 * f64::from(i), 0.9 + 0.005 * f64::from(j));
                let slack = |v: f64| iv(v - 1e-14, v + 1e-14);
                let d = a + 4.0;
                assert!(
                    first[(0, 0)]
                        .intersect(&slack(3.0 - 2.0 * a / 7.0 - 16.0 * b / (d * d)))
                        .is_some()
                );
                assert!(
                    second[0][(0, 0)]
                        .intersect(&slack(32.0 * b / (d * d * d) - 2.0 / 7.0))
                        .is_some()
                );
                assert!(
                    second[0][(0, 1)]
                        .intersect(&slack(-16.0 / (d * d)))
                        .is_some()
                );
            }
        }
    }
    let second = |form| hessian_over(&form, &x).unwrap().2.remove(0);
    let (once, quotient, reciprocal) = (
        second(Growth::Once),
        second(Growth::Quotient),
        second(Growth::Reciprocal),
    );
    near(
        once[(0, 0)],
        28.8 / 262.144 - 2.0 / 7.0,
        35.2 / 216.0 - 2.0 / 7.0,
    );
    near(once[(0, 1)], -16.0 / 36.0, -16.0 / 40.96);
    near(reciprocal[(0, 0)], -0.20771, -0.09620);
    near(reciprocal[(0, 1)], -0.47135, -0.35833);
    for entry in [(0, 0), (0, 1)] {
        assert!(
            once[entry].is_subset(quotient[entry]) && quotient[entry].is_subset(reciprocal[entry])
        );
    }
}

/// Every operation of `Real`, on six variables so that the groups of directions are not full.
struct Everything;

impl Function for Everything {
    fn inputs(&self) -> usize {
        6
    }
    fn outputs(&self) -> usize {
        3
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        y[0] = x[0].sin() * x[1].cos() + x[2].sqr() * x[5];
        y[1] = (x[3] / x[4] - 2.0).tan() - x[0].sqrt() / 3.0 + x[5].recip();
        y[2] = (x[1] * x[2] + 1.0).atan() - -x[3] * S::constant(2.0);
    }
}

/// The first and second derivatives of `Everything` by hand.
fn by_hand(x: [f64; 6]) -> ([[f64; 6]; 3], [[[f64; 6]; 6]; 3]) {
    let [a, b, c, d, e, f] = x;
    let (mut g, mut h) = ([[0.0; 6]; 3], [[[0.0; 6]; 6]; 3]);
    g[0] = [
        a.cos() * b.cos(),
        -a.sin() * b.sin(),
        2.0 * c * f,
        0.0,
        0.0,
        c * c,
    ];
    h[0][0][0] = -a.sin() * b.cos();
    h[0][0][1] = -a.cos() * b.sin();
    h[0][1][1] = -a.sin() * b.cos();
    h[0][2][2] = 2.0 * f;
    h[0][2][5] = 2.0 * c;
    let t = (d / e - 2.0).tan();
    let (s, s2) = (1.0 + t * t, 2.0 * t * (1.0 + t * t));
    g[1] = [
        -1.0 / (6.0 * a.sqrt()),
        0.0,
        0.0,
        s / e,
        -s * d / (e * e),
        -1.0 / (f * f),
    ];
    h[1][0][0] = 1.0 / (12.0 * a.powf(1.5));
    h[1][3][3] = s2 / (e * e);
    h[1][3][4] = -s2 * d / (e * e * e) - s / (e * e);
    h[1][4][4] = s2 * d * d / e.powi(4) + 2.0 * s * d / e.powi(3);
    h[1][5][5] = 2.0 / f.powi(3);
    let u = b * c + 1.0;
    let (v, v2) = (1.0 / (1.0 + u * u), -2.0 * u / (1.0 + u * u).powi(2));
    g[2] = [0.0, c * v, b * v, 2.0, 0.0, 0.0];
    h[2][1][1] = c * c * v2;
    h[2][1][2] = b * c * v2 + v;
    h[2][2][2] = b * b * v2;
    for h in &mut h {
        let upper = *h;
        *h = std::array::from_fn(|i| std::array::from_fn(|j| upper[i.min(j)][i.max(j)]));
    }
    (g, h)
}

#[test]
fn duals_give_the_derivatives_found_by_hand_and_intervals_contain_them() {
    let mut source = Source(10);
    for _ in 0..200 {
        let lower: Vec<f64> = (0..6).map(|_| 0.6 + source.uniform()).collect();
        let upper: Vec<f64> = lower.iter().map(|l| l + 0.02 * source.uniform()).collect();
        let over = IntervalVector::from_bounds(&lower, &upper).unwrap();
        let (value, first, second) = hessian_over(&Everything, &over).unwrap();
        assert_eq!(
            jacobian_over(&Everything, &over).unwrap(),
            (value.clone(), first.clone())
        );
        for _ in 0..5 {
            let x: [f64; 6] = std::array::from_fn(|i| source.within(over[i]));
            let (g, h) = by_hand(x);
            let computed = hessian(&Everything, &x);
            assert_eq!(jacobian(&Everything, &x), computed.jacobian);
            let mut y = [0.0; 3];
            Everything.evaluate(&x, &mut y);
            assert_eq!(y, computed.jacobian.value);
            for q in 0..3 {
                assert!(value[q].contains(y[q]) || (value[q].mid() - y[q]).abs() < 1e-12);
                for i in 0..6 {
                    let scale = 1e-12 * (1.0 + g[q][i].abs());
                    assert!(
                        (computed.jacobian.get(q, i) - g[q][i]).abs() <= scale,
                        "∂{i} of {q} at {x:?}"
                    );
                    assert!(
                        first[(q, i)]
                            .intersect(&iv(g[q][i] - scale, g[q][i] + scale))
                            .is_some()
                    );
                    for j in 0..6 {
                        let scale = 1e-11 * (1.0 + h[q][i][j].abs());
                        assert!(
                            (computed.get(q, i, j) - h[q][i][j]).abs() <= scale,
                            "∂{i}∂{j} of {q} at {x:?}"
                        );
                        assert!(
                            second[q][(i, j)]
                                .intersect(&iv(h[q][i][j] - scale, h[q][i][j] + scale))
                                .is_some(),
                            "∂{i}∂{j} of {q} at {x:?}"
                        );
                        if h[q][i][j] == 0.0 {
                            assert_eq!(second[q][(i, j)], Interval::ZERO, "∂{i}∂{j} of {q}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_dual_carries_the_rules_of_differentiation() {
    let x = Dual::<f64, 1>::variable(0.5, 0);
    let slope = |y: Dual<f64, 1>| y.gradient[0];
    assert_eq!(slope(x * x), 1.0);
    assert_eq!(slope(x.sqr()), 1.0);
    assert_eq!(slope(x.recip()), -4.0);
    assert_eq!(slope(x / x), 0.0);
    assert_eq!(slope(Dual::constant(1.0) / x), -4.0);
    assert_eq!(slope(x * 3.0 - 1.0), 3.0);
    assert_eq!(slope(-x / 2.0), -0.5);
    assert_eq!(slope(x.sin()), libm::cos(0.5));
    assert_eq!(slope(x.cos()), -libm::sin(0.5));
    assert_eq!(slope(x.atan()), 0.8);
    assert_eq!(slope(Dual::variable(0.25, 0).sqrt()), 1.0);
    assert_eq!(slope(x.tan()), 1.0 + libm::tan(0.5).powi(2));
    assert_eq!(slope(Dual::fixed(0.5)), 0.0);
}

/// 1/x, whose domain has a hole.
struct Inverse;

impl Function for Inverse {
    fn inputs(&self) -> usize {
        1
    }
    fn outputs(&self) -> usize {
        1
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        y[0] = x[0].recip();
    }
}

#[test]
fn derivatives_across_a_hole_of_the_domain_are_an_error() {
    let across = IntervalVector::from_bounds(&[-1.0], &[1.0]).unwrap();
    assert!(matches!(
        jacobian_over(&Inverse, &across),
        Err(SetError::Domain { .. })
    ));
    assert!(matches!(
        hessian_over(&Inverse, &across),
        Err(SetError::Domain { .. })
    ));
    let beside = IntervalVector::from_bounds(&[1.0], &[2.0]).unwrap();
    assert!(jacobian_over(&Inverse, &beside).is_ok());
    let wrong = IntervalVector::from_bounds(&[1.0, 1.0], &[2.0, 2.0]).unwrap();
    assert_eq!(
        jacobian_over(&Inverse, &wrong),
        Err(SetError::Dimension {
            op: "Jacobian over a box",
            expected: 1,
            got: 2
        })
    );
}

#[test]
fn boxes_refuse_what_is_no_box() {
    let made = IntervalVector::from_bounds(&[0.0, 1.0], &[1.0, 0.0]);
    assert_eq!(
        made,
        Err(SetError::Reversed {
            op: "box",
            index: 1,
            lower: 1.0,
            upper: 0.0
        })
    );
    assert!(matches!(
        IntervalVector::from_bounds(&[0.0], &[f64::NAN]),
        Err(SetError::NotFinite { .. })
    ));
    assert!(matches!(
        IntervalVector::from_bounds(&[f64::NEG_INFINITY], &[0.0]),
        Err(SetError::NotFinite { .. })
    ));
    let made = IntervalVector::from_bounds(&[0.0], &[1.0, 2.0]);
    assert_eq!(
        made,
        Err(SetError::Dimension {
            op: "box",
            expected: 1,
            got: 2
        })
    );
    assert!(matches!(
        IntervalVector::from_center_radius(&[0.0], &[-1.0]),
        Err(SetError::Reversed { .. })
    ));
    assert!(matches!(
        IntervalVector::from_center_radius(&[f64::MAX], &[f64::MAX]),
        Err(SetError::NotFinite { .. })
    ));
    assert!(matches!(
        IntervalVector::from_center_radius(&[0.0], &[f64::NAN]),
        Err(SetError::NotFinite { .. })
    ));
}

#[test]
fn operations_on_boxes_act_on_every_side() {
    let a = IntervalVector::from_bounds(&[0.0, 0.0], &[2.0, 2.0]).unwrap();
    let b = IntervalVector::from_bounds(&[1.0, -1.0], &[3.0, 1.0]).unwrap();
    let apart = IntervalVector::from_bounds(&[1.0, 5.0], &[3.0, 6.0]).unwrap();
    let bounds = |l: &[f64], u: &[f64]| IntervalVector::from_bounds(l, u).unwrap();
    assert_eq!(a.intersect(&b).unwrap(), bounds(&[1.0, 0.0], &[2.0, 1.0]));
    assert_eq!(
        a.intersect(&apart),
        Err(SetError::Empty {
            op: "intersection of boxes"
        })
    );
    assert_eq!(a.hull(&b).unwrap(), bounds(&[0.0, -1.0], &[3.0, 2.0]));
    assert_eq!(
        a.minkowski_sum(&b).unwrap(),
        bounds(&[1.0, -1.0], &[5.0, 3.0])
    );
    assert_eq!(
        a.difference(&b).unwrap(),
        bounds(&[-3.0, -1.0], &[1.0, 3.0])
    );
    let stacked = IntervalVector::stack(&[&a, &b]);
    assert_eq!(
        stacked,
        bounds(&[0.0, 0.0, 1.0, -1.0], &[2.0, 2.0, 3.0, 1.0])
    );
    assert_eq!(stacked.select(&[2, 0]), bounds(&[1.0, 0.0], &[3.0, 2.0]));
    assert!(a.contains(&[2.0, 0.0]) && !a.contains(&[2.1, 0.0]) && !a.contains(&[1.0]));
    assert!(a.hull(&b).unwrap().contains_box(&b) && !a.contains_box(&b));
    assert_eq!(
        (a.mid().into_vec(), a.rad().into_vec(), a.widths()),
        (vec![1.0; 2], vec![1.0; 2], vec![2.0; 2])
    );
    assert!(
        a.minkowski_sum(&IntervalVector::point(&[1.0]).unwrap())
            .is_err()
    );
    let text = serde_json::to_string(&b).unwrap();
    assert_eq!(serde_json::from_str::<IntervalVector>(&text).unwrap(), b);
    assert!(serde_json::from_str::<IntervalVector>("[[1.0, 0.0]]").is_err());
    let mut source = Source(11);
    for _ in 0..5_000 {
        let (c, r) = (source.scaled(30), source.scaled(30).abs());
        let x = IntervalVector::from_center_radius(&[c], &[r]).unwrap();
        let (c, r) = (fixed(c, SUM), fixed(r, SUM));
        assert!(is_below(x[0].lo(), &(&c - &r), SUM) && is_above(x[0].hi(), &(c + r), SUM));
    }
}

fn random_matrix(source: &mut Source, rows: usize, cols: usize) -> IntervalMatrix {
    IntervalMatrix::from_fn(rows, cols, |_, _| match source.below(5) {
        0 => Interval::ZERO,
        1 => Interval::point(source.scaled(30)),
        _ => Interval::from_center_radius(source.scaled(30), source.scaled(30).abs()),
    })
}

fn sample(source: &mut Source, m: &IntervalMatrix) -> Matrix {
    Matrix::from_fn(m.rows(), m.cols(), |i, j| source.within(m[(i, j)]))
}

type Rational = Vec<Vec<BigRational>>;

fn rationals(m: &Matrix) -> Rational {
    (0..m.rows())
        .map(|i| m.row(i).iter().map(|&x| rational(x)).collect())
        .collect()
}

fn exact_product(a: &Rational, b: &Rational) -> Rational {
    let entry = |row: &Vec<BigRational>, j: usize| {
        row.iter()
            .zip(b)
            .fold(BigRational::zero(), |s, (x, row)| s + x * &row[j])
    };
    a.iter()
        .map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect())
        .collect()
}

fn assert_contains(m: &IntervalMatrix, exact: &Rational) {
    assert_eq!((m.rows(), m.cols()), (exact.len(), exact[0].len()));
    for (i, row) in exact.iter().enumerate() {
        for (j, x) in row.iter().enumerate() {
            let entry = m[(i, j)];
            assert!(
                rational(entry.lo()) <= *x && *x <= rational(entry.hi()),
                "({i}, {j}): {entry:?}"
            );
        }
    }
}

#[test]
fn products_of_interval_matrices_contain_the_exact_products() {
    let mut source = Source(12);
    for _ in 0..150 {
        let (n, k, m) = (
            1 + source.below(4),
            1 + source.below(5),
            1 + source.below(4),
        );
        let (a, b) = (
            random_matrix(&mut source, n as usize, k as usize),
            random_matrix(&mut source, k as usize, m as usize),
        );
        let product = a.mul(&b);
        for _ in 0..3 {
            let (x, y) = (sample(&mut source, &a), sample(&mut source, &b));
            assert!(a.contains(&x) && b.contains(&y));
            let (xr, yr) = (rationals(&x), rationals(&y));
            let exact = exact_product(&xr, &yr);
            assert_contains(&product, &exact);
            assert_contains(&b.left_mul(&x), &exact);
            assert_contains(&a.mul_matrix(&y), &exact);
            // Points: nothing but rounding is left.
            assert_contains(
                &IntervalMatrix::from(&x).mul(&IntervalMatrix::from(&y)),
                &exact,
            );
            let column: IntervalVector = (0..b.rows()).map(|i| b[(i, 0)]).collect();
            let image = a.mul_vec(&column);
            assert_contains(
                &IntervalMatrix::from_fn(a.rows(), 1, |i, _| image[i]),
                &exact.iter().map(|row| vec![row[0].clone()]).collect(),
            );
            let z = sample(&mut source, &a);
            let zr = rationals(&z);
            let combine = |f: fn(&BigRational, &BigRational) -> BigRational| -> Rational {
                xr.iter()
                    .zip(&zr)
                    .map(|(p, q)| p.iter().zip(q).map(|(x, z)| f(x, z)).collect())
                    .collect()
            };
            assert_contains(&a.add(&a), &combine(|x, z| x + z));
            assert_contains(&a.sub(&a), &combine(|x, z| x - z));
            assert_contains(
                &a.scale(Interval::point(0.1)),
                &exact_product(&vec![vec![rational(0.1)]], &vec![xr.concat()])[0]
                    .chunks(a.cols())
                    .map(<[_]>::to_vec)
                    .collect(),
            );
            for (i, bound) in a.abs_row_sums().into_iter().enumerate() {
                let exact = xr[i].iter().fold(BigRational::zero(), |s, x| s + x.abs());
                assert!(exact <= rational(bound) && bound <= a.norm_inf());
            }
            let distance = |i: usize, j: usize| (&xr[i][j] - rational(a.mid()[(i, j)])).abs();
            assert!(
                (0..a.rows())
                    .all(|i| (0..a.cols()).all(|j| distance(i, j) <= rational(a.rad()[(i, j)])))
            );
        }
    }
}

#[test]
fn powers_of_an_interval_matrix_contain_the_exact_powers() {
    let mut source = Source(13);
    for _ in 0..20 {
        let a = IntervalMatrix::from_fn(3, 3, |_, _| {
            Interval::from_center_radius(source.signed(), 1e-12)
        });
        let point = sample(&mut source, &a);
        let (m, powers) = (rationals(&point), a.powers(5));
        assert_eq!(powers[0], IntervalMatrix::identity(3));
        let mut exact = rationals(&Matrix::identity(3));
        for (k, power) in powers.iter().enumerate() {
            assert_eq!(*power, a.power(k));
            assert_contains(power, &exact);
            exact = exact_product(&exact, &m);
        }
    }
}

#[test]
fn blocks_of_interval_matrices_keep_their_entries() {
    let mut source = Source(14);
    let (a, b) = (
        random_matrix(&mut source, 2, 3),
        random_matrix(&mut source, 2, 1),
    );
    let wide = IntervalMatrix::hcat(&[&a, &b]);
    assert_eq!((wide.rows(), wide.cols()), (2, 4));
    assert_eq!(wide[(1, 3)], b[(1, 0)]);
    assert_eq!(wide.select_columns(&[0, 1, 2]), a);
    let tall = IntervalMatrix::vcat(&[&a.transpose(), &IntervalMatrix::identity(2)]);
    assert_eq!((tall.rows(), tall.cols()), (5, 2));
    assert_eq!(tall.row(1), [a[(0, 1)], a[(1, 1)]]);
    assert_eq!(tall[(4, 1)], Interval::ONE);
    let made = IntervalMatrix::from_bounds(&a.lower(), &a.upper()).unwrap();
    assert_eq!(made, a);
    assert!(IntervalMatrix::from_bounds(&a.lower(), &b.upper()).is_err());
    assert_eq!(a.hull(&a), a);
    let overflow = IntervalMatrix::from_fn(1, 1, |_, _| Interval::point(f64::MAX));
    assert!(!overflow.add(&overflow).is_finite());
    assert!(matches!(
        overflow.add(&overflow).finite("sum"),
        Err(SetError::Domain { op: "sum", .. })
    ));
}

#[test]
fn gamma_is_an_upper_bound() {
    let u = rational(U);
    for k in (0..2000).chain((11..40).map(|e| (1usize << e) - 1)) {
        let ku = rational(k as f64) * &u;
        let exact = &ku / (rational(1.0) - &ku);
        assert!(rational(gamma(k)) >= exact, "k = {k}");
        assert!(rational(gamma(k)) <= exact * rational(1.001), "k = {k}");
    }
}

#[test]
fn two_roundings_are_bounded_where_one_step_up_is_not_enough() {
    let mut source = Source(15);
    let (mut lost_by_next_up, mut total) = (0, 0);
    for _ in 0..10_000 {
        let [a, b, c] = std::array::from_fn(|_| 0.5 + source.uniform());
        let exact = fixed(a, SUM) * fixed(b, SUM) * fixed(c, SUM);
        let p = a * b * c;
        assert!(is_above(up(p, 2), &exact, 3 * SUM), "{a} {b} {c}");
        lost_by_next_up += usize::from(!is_above(p.next_up(), &exact, 3 * SUM));
        total += 1;
    }
    // The reason for the factor 1 + 2γ.
    assert!(
        lost_by_next_up > 0,
        "next_up alone lost {lost_by_next_up} of {total}"
    );
    for _ in 0..3_000 {
        let n = 1 + source.below(30) as usize;
        let exponent = [3, 30, 500][source.below(3) as usize];
        let terms: Vec<(f64, f64)> = (0..n)
            .map(|_| (source.scaled(exponent).abs(), source.scaled(exponent).abs()))
            .collect();
        let s = terms.iter().fold(0.0, |s, (a, b)| s + a * b);
        let exact = terms.iter().fold(BigInt::zero(), |s, (a, b)| {
            s + fixed(*a, SUM) * fixed(*b, SUM)
        });
        assert!(is_above(up(s, n + 1), &exact, PRODUCT), "{terms:?}");
    }
    assert!((ETA..2.0 * ETA).contains(&up(0.0, 3)));
    assert_eq!(up(f64::NAN, 1), f64::INFINITY);
    assert_eq!(up(f64::MAX, 1), f64::INFINITY);
}
