//! From values to pixels, and where the ticks stand.
//!
//! A tick is an integer times a power of ten, so that its label is the digits of the integer and no
//! rounding of a sum of steps ever shows.

use super::Axis;

/// The length of a panel's side, the part of the axis on it and where its ticks are.
pub(super) struct Scale {
    low: f64,
    high: f64,
    log: bool,
    pixels: f64,
    /// The first value lies at the far end: y grows upwards, pixels downwards.
    upwards: bool,
}

/// A tick and its label; minor ticks have none.
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: Option<String>,
}

impl Scale {
    /// The scale of `axis` for `values`: from the least to the greatest that can be drawn, with a
    /// little to spare, where the axis does not say itself.
    pub(super) fn new(
        axis: &Axis,
        values: impl Iterator<Item = f64>,
        pixels: f64,
        upwards: bool,
    ) -> Self {
        // Beyond 1e300 a difference of two values may be infinite.
        let drawable = |v: &f64| v.abs() < 1e300 && (!axis.log || *v > 1e-300);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(drawable) {
            low = low.min(v);
            high = high.max(v);
        }
        if low > high {
            (low, high) = if axis.log { (1.0, 10.0) } else { (0.0, 1.0) };
        }
        if axis.log {
            let spare = libm::pow(high / low, 0.04).max(1.05);
            (low, high) = (low / spare, high * spare);
        } else {
            let size = high - low;
            let spare = if size > 1e-300 {
                0.04 * size
            } else {
                (0.05 * high.abs()).max(0.5)
            };
            (low, high) = (low - spare, high + spare);
        }
        if let Some(min) = axis.min.filter(drawable) {
            low = min;
        }
        if let Some(max) = axis.max.filter(drawable) {
            high = max;
        }
        if low >= high {
            (low, high) = if axis.log {
                (low, low * 10.0)
            } else {
                (low, low + low.abs().max(1.0))
            };
        }
        Scale {
            low,
            high,
            log: axis.log,
            pixels,
            upwards,
        }
    }

    /// Where `value` lies, in pixels from the left or the top; None where it cannot be drawn.
    pub(super) fn pixel(&self, value: f64) -> Option<f64> {
        let part = if self.log {
            if value <= 0.0 {
                return None;
            }
            libm::log10(value / self.low) / libm::log10(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        let pixel = if self.upwards { 1.0 - part } else { part } * self.pixels;
        // What lies far outside is cut off anyway, and numbers stay short.
        pixel.is_finite().then(|| pixel.clamp(-1e5, 1e5))
    }

    pub(super) fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    fn units_per_pixel(&self) -> f64 {
        (self.high - self.low) / self.pixels
    }

    /// Widens one of two linear scales until a unit is as long on both.
    pub(super) fn make_equal(x: &mut Scale, y: &mut Scale) {
        if x.log || y.log {
            return;
        }
        let unit = x.units_per_pixel().max(y.units_per_pixel());
        for scale in [x, y] {
            let spare = (unit * scale.pixels - (scale.high - scale.low)) / 2.0;
            scale.low -= spare;
            scale.high += spare;
        }
    }

    /// The ticks, about one every `spacing` pixels and three at least.
    pub(super) fn ticks(&self, spacing: f64) -> Vec<Tick> {
        let most = (self.pixels / spacing).max(3.0);
        let decades = libm::log10(self.high / self.low);
        if self.log && decades >= 1.0 {
            return self.decades(decades, most);
        }
        let mut step = Step::about((self.high - self.low) / most);
        let (first, last) = loop {
            let first = (self.low / step.size()).ceil() as i64;
            let last = (self.high / step.size()).floor() as i64;
            // A range of a few roundings of its ends has no round numbers in it.
            if first.max(last).abs().max(first.min(last).abs()) > 1 << 50 {
                return Vec::new();
            }
            if last - first >= 2 {
                break (first, last);
            }
            step = step.finer();
        };
        (first..=last)
            .map(|i| Tick {
                value: step.times(i),
                label: Some(step.label(i)),
            })
            .collect()
    }

    /// Powers of ten, labelled as often as there is room, with 2 and 5 between them where there is
    /// much; the other digits have ticks without labels.
    fn decades(&self, decades: f64, most: f64) -> Vec<Tick> {
        let every = (decades / most).ceil() as i64;
        let roomy = 3.0 * decades <= most;
        let plain = self.low >= 1e-4 && self.high < 1e5;
        let first = libm::log10(self.low).floor() as i64;
        let last = libm::log10(self.high).ceil() as i64;
        let mut ticks = Vec::new();
        for exponent in first..=last {
            for digit in 1..10 {
                let step = Step { digit, exponent };
                let value = step.size();
                let labelled = match digit {
                    1 => exponent.rem_euclid(every) == 0,
                    2 | 5 => roomy,
                    _ => false,
                };
                if value >= self.low && value <= self.high && (every == 1 || digit == 1) {
                    let label = || match digit {
                        1 if !plain => power(exponent),
                        _ => step.label(1),
                    };
                    ticks.push(Tick {
                        value,
                        label: labelled.then(label),
                    });
                }
            }
        }
        ticks
    }
}

/// A round distance between ticks: `digit` · 10^`exponent`, the digit 1, 2 or 5.
struct Step {
    digit: i64,
    exponent: i64,
}

impl Step {
    fn about(size: f64) -> Self {
        let exponent = libm::log10(size).floor();
        let rest = size / libm::pow(10.0, exponent);
        let exponent = exponent as i64;
        let (digit, exponent) = match rest {
            r if r <= 1.0 => (1, exponent),
            r if r <= 2.0 => (2, exponent),
            r if r <= 5.0 => (5, exponent),
            _ => (1, exponent + 1),
        };
        Step { digit, exponent }
    }

    /// The next smaller one.
    fn finer(self) -> Self {
        let exponent = self.exponent;
        match self.digit {
            1 => Step {
                digit: 5,
                exponent: exponent - 1,
            },
            2 => Step { digit: 1, exponent },
            _ => Step { digit: 2, exponent },
        }
    }

    fn size(&self) -> f64 {
        self.times(1)
    }

    fn times(&self, i: i64) -> f64 {
        let integer = (i * self.digit) as f64;
        let power = libm::pow(10.0, self.exponent.abs() as f64);
        if self.exponent < 0 {
            integer / power
        } else {
            integer * power
        }
    }

    /// i · step with exactly the decimals the step has; very large and very small ones as 3×10⁶.
    fn label(&self, i: i64) -> String {
        let integer = i * self.digit;
        if integer == 0 {
            return "0".to_owned();
        }
        let sign = if integer < 0 { "−" } else { "" };
        let digits = integer.unsigned_abs().to_string();
        if self.exponent > 4 || self.exponent < -4 {
            let trimmed = digits.trim_end_matches('0');
            let exponent = self.exponent + (digits.len() - 1) as i64;
            let (first, rest) = trimmed.split_at(1);
            let point = if rest.is_empty() { "" } else { "." };
            return format!("{sign}{first}{point}{rest}×{}", power(exponent));
        }
        if self.exponent >= 0 {
            return format!("{sign}{digits}{}", "0".repeat(self.exponent as usize));
        }
        let decimals = self.exponent.unsigned_abs() as usize;
        let digits = format!("{digits:0>width$}", width = decimals + 1);
        let (whole, part) = digits.split_at(digits.len() - decimals);
        format!("{sign}{whole}.{part}")
    }
}

/// 10 to the `exponent`, in superscripts.
fn power(exponent: i64) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32('⁰' as u32 + (c as u32 - '0' as u32))
            .expect("superscript digits are a block"),
        other => other,
    });
    format!("10{}", raised.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, log: bool) -> Vec<String> {
        let axis = Axis {
            log,
            min: Some(low),
            max: Some(high),
            ..Axis::default()
        };
        let scale = Scale::new(&axis, std::iter::empty(), 300.0, false);
        scale
            .ticks(60.0)
            .into_iter()
            .filter_map(|t| t.label)
            .collect()
    }

    #[test]
    fn labels_have_the_decimals_of_the_step() {
        assert_eq!(
            labels(-0.5, 0.5, false),
            ["−0.4", "−0.2", "0", "0.2", "0.4"]
        );
        assert_eq!(
            labels(0.0, 500.0, false),
            ["0", "100", "200", "300", "400", "500"]
        );
        assert_eq!(
            labels(0.99, 1.01, false),
            ["0.990", "0.995", "1.000", "1.005", "1.010"]
        );
        assert_eq!(labels(0.0, 3e6, false), ["0", "1×10⁶", "2×10⁶", "3×10⁶"]);
        assert_eq!(
            labels(0.0, 2.4e-6, false),
            ["0", "5×10⁻⁷", "1×10⁻⁶", "1.5×10⁻⁶", "2×10⁻⁶"]
        );
    }

    #[test]
    fn decades_are_powers_of_ten() {
        assert_eq!(labels(0.5, 2000.0, true), ["1", "10", "100", "1000"]);
        assert_eq!(labels(0.5, 2e6, true), ["10⁰", "10²", "10⁴", "10⁶"]);
        assert_eq!(labels(2.0, 90.0, true)[..3], ["2", "5", "10"]);
        assert_eq!(
            labels(1e-12, 1e6, true),
            ["10⁻¹²", "10⁻⁸", "10⁻⁴", "10⁰", "10⁴"]
        );
    }

    #[test]
    fn extreme_ranges_have_few_ticks_or_none() {
        let ranges = [
            [1.0, 1.0 + f64::EPSILON],
            [-1e308, 1e308],
            [-1e299, 1e299],
            [0.0, 1e-320],
            [1e17, 1e17 + 32.0],
            [5.0, 5.0],
        ];
        for range in ranges {
            for log in [false, true] {
                let axis = Axis {
                    log,
                    ..Axis::default()
                };
                let scale = Scale::new(&axis, range.into_iter(), 300.0, false);
                assert!(scale.ticks(50.0).len() < 40, "{range:?}");
            }
        }
    }

    #[test]
    fn a_unit_is_as_long_on_equal_axes() {
        let mut x = Scale::new(&Axis::default(), [0.0, 10.0].into_iter(), 300.0, false);
        let mut y = Scale::new(&Axis::default(), [0.0, 1.0].into_iter(), 200.0, true);
        Scale::make_equal(&mut x, &mut y);
        let across = x.pixel(3.0).unwrap() - x.pixel(2.0).unwrap();
        let upwards = y.pixel(2.0).unwrap() - y.pixel(3.0).unwrap();
        assert!((across - upwards).abs() < 1e-9); // rounding of numbers near 300
        assert_eq!(y.pixel(0.5), Some(100.0));
    }

    #[test]
    fn what_has_no_logarithm_is_not_drawn() {
        let axis = Axis {
            log: true,
            ..Axis::default()
        };
        let scale = Scale::new(
            &axis,
            [0.0, -1.0, 1.0, 100.0, f64::NAN].into_iter(),
            100.0,
            false,
        );
        assert_eq!(scale.pixel(0.0), None);
        assert!((scale.pixel(10.0).unwrap() - 50.0).abs() < 1e-9); // rounding of logarithms
    }
}
