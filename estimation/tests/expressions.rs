//! Random equations against their values at 256 bits: no enclosure loses one, and every text is read as it was meant.
//!
//! An expression is drawn as a tree. The tree is written as a text, with as few parentheses as the language needs, which
//! [`Equations`] reads and encloses; and it is evaluated at 256 bits by `astro-float`, without the text. So a mistake of the reader, of the
//! tape, of a folded constant or of an enclosure shows as a value outside.
//!
//! `ZONOBENCH_EXPRESSIONS=1000000` draws so many.

use astro_float::{BigFloat, Consts, RoundingMode};
use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::systems::Equations;
use zonobench_estimation::systems::equations::{Motion, Source};
use zonobench_estimation::{System, systems::equations::LARGEST_DEPTH};
use zonobench_sets::Interval;

const BITS: usize = 256;
/// More bits than cancel in eˣ − 1 and ln(1 + x) for the arguments that are looked at.
const WIDE: usize = BITS + 96;
/// Of + − · / and √, which are exact where the result has no more bits.
const ROUND: RoundingMode = RoundingMode::ToEven;
/// Of the other functions: to within a few units of the last bit. Rounding them rightly may take for ever where the result is exact.
const NEAR: RoundingMode = RoundingMode::None;
/// What an evaluation may lose, over the largest number on its way: 2 to this. An f64 is 2¹⁴⁷ times as coarse.
const SLACK: i32 = -200;
const NAMES: [&str; 3] = ["p", "q_1", "Omega"];
/// Parameters, one of which is no sum of few powers of two.
const PARAMETERS: [(&str, f64); 2] = [("c", 0.1), ("big", 1e3)];

#[derive(Clone, Debug)]
enum Tree {
    Number(f64, String),
    State(usize),
    Parameter(usize),
    Neg(Box<Tree>),
    Binary(char, Box<Tree>, Box<Tree>),
    Power(Box<Tree>, i32),
    Call(&'static str, Box<Tree>),
    Pair(&'static str, Box<Tree>, Box<Tree>),
}

const CALLS: [&str; 18] = [
    "sqrt", "sqr", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "exp_m1", "ln", "log10",
    "ln_1p", "sinh", "cosh", "tanh", "asinh", "abs",
];
const PAIRS: [&str; 5] = ["hypot", "atan2", "min", "max", "pow"];

/// Numbers between 0 and 1, one after the other.
struct Stream {
    draws: Draws,
    next: usize,
}

impl Stream {
    fn share(&mut self) -> f64 {
        self.next += 1;
        0.5 + 0.5 * self.draws.uniform(self.next, 0, 0)
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.share() * n as f64) as usize).min(n - 1)
    }
}

impl Tree {
    fn drawn(stream: &mut Stream, depth: usize) -> Self {
        let kind = if depth == 0 {
            stream.below(4)
        } else {
            stream.below(14)
        };
        let inner = |stream: &mut Stream| Box::new(Self::drawn(stream, depth - 1));
        match kind {
            0 => Self::number(stream),
            1 | 2 => Self::State(stream.below(NAMES.len())),
            3 => Self::Parameter(stream.below(PARAMETERS.len())),
            4 => Self::Neg(inner(stream)),
            5..=8 => {
                let sign = ['+', '-', '*', '/'][kind - 5];
                let (a, b) = (inner(stream), inner(stream));
                Self::Binary(sign, a, b)
            }
            9 => {
                let exponent = [-3, -2, -1, 1, 2, 3, 4, 5, 7][stream.below(9)];
                Self::Power(inner(stream), exponent)
            }
            10..=12 => Self::Call(CALLS[stream.below(CALLS.len())], inner(stream)),
            _ => {
                let name = PAIRS[stream.below(PAIRS.len())];
                let (a, b) = (inner(stream), inner(stream));
                Self::Pair(name, a, b)
            }
        }
    }

    fn number(stream: &mut Stream) -> Self {
        let (of, digits) = (stream.share(), stream.below(4));
        let text = match stream.below(4) {
            0 => format!("{}", stream.below(10)),
            1 => format!("{:.digits$}", 10.0 * of),
            2 => format!("{:.digits$}e{}", 1.0 + of, stream.below(9) as i32 - 4),
            _ => ["0.5", ".25", "1.", "1E3", "2e-1", "3"][stream.below(6)].to_owned(),
        };
        Self::Number(text.parse().unwrap(), text)
    }

    /// How strongly it holds together: sums 1, products 2, signs 3, powers 4, the rest 5.
    fn strength(&self) -> u8 {
        match self {
            Self::Binary('+' | '-', ..) => 1,
            Self::Binary(..) => 2,
            Self::Neg(_) => 3,
            Self::Power(..) => 4,
            _ => 5,
        }
    }

    fn written(&self, stream: &mut Stream) -> String {
        let mut with = |of: &Tree, least: u8| {
            let text = of.written(stream);
            // Now and then a pair more than is needed.
            match of.strength() < least || stream.below(16) == 0 {
                true => format!("({text})"),
                false => text,
            }
        };
        match self {
            Self::Number(_, text) => text.clone(),
            Self::State(i) => NAMES[*i].to_owned(),
            Self::Parameter(i) => PARAMETERS[*i].0.to_owned(),
            Self::Neg(a) => format!("-{}", with(a, 3)),
            Self::Binary(sign, a, b) => {
                let own = self.strength();
                let (a, b) = (with(a, own), with(b, own + 1));
                match stream.below(2) {
                    0 => format!("{a}{sign}{b}"),
                    _ => format!("{a} {sign} {b}"),
                }
            }
            Self::Power(a, n) => {
                let base = with(a, 5);
                let sign = ["^", "**", " ** "][stream.below(3)];
                format!("{base}{sign}{n}")
            }
            Self::Call(f, a) => format!("{f}({})", with(a, 0)),
            Self::Pair(f, a, b) => {
                let (a, b) = (with(a, 0), with(b, 0));
                format!("{f}({a}, {b})")
            }
        }
    }

    /// The value at `x`, None where there is none; `largest` becomes the exponent of the largest number on the way.
    fn value(&self, x: &[f64; 3], consts: &mut Consts, largest: &mut i32) -> Option<BigFloat> {
        let value = self.plain_value(x, consts, largest)?;
        *largest = value.exponent().map_or(*largest, |e| e.max(*largest));
        (!value.is_nan()).then_some(value)
    }

    fn plain_value(
        &self,
        x: &[f64; 3],
        consts: &mut Consts,
        largest: &mut i32,
    ) -> Option<BigFloat> {
        let number = |x: f64| BigFloat::from_f64(x, BITS);
        let (one, zero) = (number(1.0), number(0.0));
        let mut of = |tree: &Tree| tree.value(x, consts, largest);
        Some(match self {
            Self::Number(x, _) => number(*x),
            Self::State(i) => number(x[*i]),
            Self::Parameter(i) => number(PARAMETERS[*i].1),
            Self::Neg(a) => of(a)?.neg(),
            Self::Binary(sign, a, b) => {
                let (a, b) = (of(a)?, of(b)?);
                match sign {
                    '+' => a.add(&b, BITS, ROUND),
                    '-' => a.sub(&b, BITS, ROUND),
                    '*' => a.mul(&b, BITS, ROUND),
                    _ if b.is_zero() => return None,
                    _ => a.div(&b, BITS, ROUND),
                }
            }
            Self::Power(a, n) => {
                let a = of(a)?;
                let power = a.powi(n.unsigned_abs() as usize, BITS, ROUND);
                match n {
                    1.. => power,
                    _ if a.is_zero() => return None,
                    _ => one.div(&power, BITS, ROUND),
                }
            }
            Self::Call(f, a) => {
                let a = of(a)?;
                let most = match *f {
                    "sqrt" | "sqr" | "abs" => i32::MAX,
                    // Beyond 709 their enclosures have no upper bound.
                    "exp" | "exp_m1" | "sinh" | "cosh" => 12,
                    _ => 40,
                };
                is_moderate(&a, most).then_some(())?;
                let is_below = |least: &BigFloat| a.cmp(least).is_none_or(|c| c < 0);
                match *f {
                    "sqrt" if is_below(&zero) => return None,
                    "sqrt" => a.sqrt(BITS, ROUND),
                    "sqr" => a.mul(&a, BITS, ROUND),
                    "sin" => a.sin(BITS, NEAR, consts),
                    "cos" => a.cos(BITS, NEAR, consts),
                    "tan" => a.tan(BITS, NEAR, consts),
                    "asin" | "acos" if a.abs().cmp(&one).is_none_or(|c| c > 0) => return None,
                    "asin" => a.asin(BITS, NEAR, consts),
                    "acos" => a.acos(BITS, NEAR, consts),
                    "atan" => a.atan(BITS, NEAR, consts),
                    "exp" => a.exp(BITS, NEAR, consts),
                    "exp_m1" => a.exp(WIDE, NEAR, consts).sub(&one, WIDE, ROUND),
                    "ln" | "log10" if is_below(&zero) || a.is_zero() => return None,
                    "ln" => a.ln(BITS, NEAR, consts),
                    "log10" => a.log10(BITS, NEAR, consts),
                    "ln_1p" => {
                        let b = a.add(&one, WIDE, ROUND);
                        if b.is_zero() || b.cmp(&zero).is_none_or(|c| c < 0) {
                            return None;
                        }
                        b.ln(WIDE, NEAR, consts)
                    }
                    "sinh" => a.sinh(BITS, NEAR, consts),
                    "cosh" => a.cosh(BITS, NEAR, consts),
                    "tanh" => a.tanh(BITS, NEAR, consts),
                    "asinh" => a.asinh(BITS, NEAR, consts),
                    _ => a.abs(),
                }
            }
            Self::Pair(f, a, b) => {
                let (a, b) = (of(a)?, of(b)?);
                let is_less = a.cmp(&b)? < 0;
                match *f {
                    "hypot" => {
                        let square = |x: &BigFloat| x.mul(x, BITS, ROUND);
                        square(&a).add(&square(&b), BITS, ROUND).sqrt(BITS, ROUND)
                    }
                    "min" => {
                        if is_less {
                            a
                        } else {
                            b
                        }
                    }
                    "max" => {
                        if is_less {
                            b
                        } else {
                            a
                        }
                    }
                    "pow" if a.is_zero() || a.is_negative() => return None,
                    "pow" if !(is_moderate(&a, 40) && is_moderate(&b, 6)) => return None,
                    "pow" => a.pow(&b, BITS, NEAR, consts),
                    "atan2" if !(is_moderate(&a, 40) && is_moderate(&b, 40)) => return None,
                    _ => return angle(&a, &b, consts),
                }
            }
        })
    }
}

/// Whether 2⁻⁸⁰ ≤ |x| < 2^`most`, or x is 0: outside of it a value takes long at 256 bits. The functions' ends are held against
/// values of their own, in the tests of the numbers.
fn is_moderate(x: &BigFloat, most: i32) -> bool {
    let is_within = |e: i32| most == i32::MAX || (-80..=most).contains(&e);
    x.is_zero() || x.exponent().is_some_and(is_within)
}

/// The angle of the point (x, y) in (−π, π].
fn angle(y: &BigFloat, x: &BigFloat, consts: &mut Consts) -> Option<BigFloat> {
    if x.is_zero() && y.is_zero() {
        return None;
    }
    let pi = consts.pi(BITS, ROUND);
    if x.is_zero() {
        let half = pi.div(&BigFloat::from_f64(2.0, BITS), BITS, ROUND);
        return Some(if y.is_negative() { half.neg() } else { half });
    }
    let slope = y.div(x, BITS, ROUND).atan(BITS, NEAR, consts);
    let turned = match (x.is_negative(), y.is_negative() && !y.is_zero()) {
        (false, _) => slope,
        (true, false) => slope.add(&pi, BITS, ROUND),
        (true, true) => slope.sub(&pi, BITS, ROUND),
    };
    Some(turned)
}

/// The system whose state p moves as `text`.
fn system(text: &str) -> Result<Equations, String> {
    let stays = |name: &&str| ((*name).to_owned(), (*name).to_owned());
    let mut next: Vec<(String, String)> = NAMES.iter().map(stays).collect();
    next[0].1 = text.to_owned();
    let source = Source {
        x: NAMES
            .iter()
            .map(|n| ((*n).to_owned(), "1".to_owned()))
            .collect(),
        u: Vec::new(),
        w: Vec::new(),
        y: Vec::new(),
        v: Vec::new(),
        parameters: PARAMETERS
            .iter()
            .map(|(n, x)| ((*n).to_owned(), *x))
            .collect(),
        definitions: Vec::new(),
        motion: Motion::Next(next),
        output: Vec::new(),
        period: None,
    };
    Equations::new(source).map_err(|fault| fault.to_string())
}

/// Whether `value`, which is known to `slack`, may be in the enclosure.
fn contains(enclosure: &Interval, value: &BigFloat, slack: &BigFloat) -> bool {
    let at = |x: f64| BigFloat::from_f64(x, 64);
    let (above, below) = (value.add(slack, BITS, ROUND), value.sub(slack, BITS, ROUND));
    let is_above = enclosure.lo() == f64::NEG_INFINITY
        || at(enclosure.lo()).cmp(&above).is_some_and(|c| c <= 0);
    let is_below =
        enclosure.hi() == f64::INFINITY || at(enclosure.hi()).cmp(&below).is_some_and(|c| c >= 0);
    is_above && is_below
}

#[test]
fn no_enclosure_of_a_random_expression_loses_its_value() {
    let wanted = std::env::var("ZONOBENCH_EXPRESSIONS").ok();
    let wanted: usize = wanted.map_or(100_000, |n| n.parse().expect("a number of expressions"));
    let mut consts = Consts::new().expect("there is memory");
    let mut stream = Stream {
        draws: Draws::new(2026, Purpose::Delta, 0),
        next: 0,
    };
    let (mut judged, mut bounded, mut refused, mut undefined) = (0, 0, 0, 0);
    while judged < wanted {
        let depth = 1 + stream.below(5);
        assert!(depth < LARGEST_DEPTH);
        let tree = Tree::drawn(&mut stream, depth);
        let text = tree.written(&mut stream);
        let system = match system(&text) {
            Ok(system) => system,
            // A constant that is no number, or a division by 0: said before anything runs.
            Err(why) => {
                assert!(
                    why.contains("a finite number") || why.contains("a divisor that is not 0"),
                    "{text}: {why}"
                );
                refused += 1;
                continue;
            }
        };
        // A point, and a box around it of any size in which it lies anywhere.
        let scale = [0.1, 1.0, 3.0, 100.0][stream.below(4)];
        let x: [f64; 3] = std::array::from_fn(|_| scale * (2.0 * stream.share() - 1.0));
        let width = [0.0, 1e-9, 1e-2, 1.0][stream.below(4)];
        let over: [Interval; 3] = std::array::from_fn(|i| {
            let (below, above) = (width * stream.share(), width * stream.share());
            Interval::new(x[i] - below, x[i] + above).unwrap()
        });
        let mut next = [Interval::ENTIRE; 3];
        system.f(0, &over, &[], &[], &mut next);
        let mut largest = i32::MIN / 2;
        let Some(value) = tree.value(&x, &mut consts, &mut largest) else {
            undefined += 1;
            continue;
        };
        let mut slack = BigFloat::from_f64(1.0, BITS);
        slack.set_exponent(largest.max(-1000) + SLACK);
        judged += 1;
        bounded += usize::from(next[0].is_finite());
        assert!(
            contains(&next[0], &value, &slack),
            "{text} at {x:?} over {over:?} is {value}, and not in {:?}",
            next[0]
        );
    }
    println!(
        "{judged} values, {bounded} in bounded enclosures; {undefined} are not defined, {refused} texts refused"
    );
    assert!(
        10 * bounded > 7 * judged,
        "{bounded} of {judged} are bounded"
    );
}

#[test]
fn no_text_makes_the_reader_panic() {
    let words = [
        "p", "q_1", "Omega", "c", "x", "sin", "atan2", "min", "sqrt", "(", ")", "(", ")", ",", "+",
        "-", "*", "/", "^", "**", "0", "1", "2.5", "1e9", "1e999", ".", "e", "E", "pi", "k", "t",
        " ", "\t", "\n", "é", "×", "\u{0}", "=", "[", "_", "1e-320", "-0",
    ];
    let mut stream = Stream {
        draws: Draws::new(7, Purpose::Delta, 0),
        next: 0,
    };
    let mut read = 0;
    for _ in 0..100_000 {
        let length = 1 + stream.below(12);
        let text: String = (0..length)
            .map(|_| words[stream.below(words.len())])
            .collect();
        let Ok(system) = system(&text) else { continue };
        read += 1;
        let mut next = [Interval::ENTIRE; 3];
        system.f(3, &[Interval::UNIT; 3], &[], &[], &mut next);
        let over = [Interval::UNIT; 3].into_iter().collect();
        let _ = (system.domain_fault(&over), system.dependence());
        let _ = system.steepest(0, 0, &over, &[], &[]);
    }
    assert!(read > 1000, "{read} texts read");
}
