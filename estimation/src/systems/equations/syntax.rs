//! The language of equations: from a text to its terms, each with its place.
//!
//! Numbers, names, `+ - * /`, `^` and `**` (from the right, above the sign: −3^2 = −9), parentheses and functions. A text is
//! read by operator precedence (Pratt 1973). Terms lie in one list in which operands stand before what uses them, so
//! that whoever walks it needs no recursion; only nesting is recursive, and it is bounded.

use std::ops::Range;

/// How deep parentheses, signs and powers may nest.
pub const LARGEST_DEPTH: usize = 200;

/// How long a text may be, in bytes.
pub const LARGEST_TEXT: usize = 1 << 20;

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrong {
    /// Bytes of the text.
    pub range: Range<usize>,
    /// What was expected.
    pub expected: String,
    /// What came.
    pub got: String,
    /// Names that there are, where one was not found.
    pub known: Vec<String>,
}

impl Wrong {
    pub(super) fn new(
        range: Range<usize>,
        expected: impl Into<String>,
        got: impl Into<String>,
    ) -> Self {
        Self {
            range,
            expected: expected.into(),
            got: got.into(),
            known: Vec::new(),
        }
    }
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// √x
    Sqrt,
    /// x²
    Sqr,
    /// sin x
    Sin,
    /// cos x
    Cos,
    /// tan x
    Tan,
    /// arcsin x
    Asin,
    /// arccos x
    Acos,
    /// arctan x
    Atan,
    /// eˣ
    Exp,
    /// eˣ − 1
    ExpM1,
    /// ln x
    Ln,
    /// log₁₀ x
    Log10,
    /// ln(1 + x)
    Ln1p,
    /// sinh x
    Sinh,
    /// cosh x
    Cosh,
    /// tanh x
    Tanh,
    /// arsinh x
    Asinh,
    /// |x|
    Abs,
}

/// A function of two numbers; `min` and `max` take more, two by two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pairing {
    /// The angle of the point (second, first)
    Atan2,
    /// √(x² + y²)
    Hypot,
    /// The smaller
    Min,
    /// The larger
    Max,
    /// x^y
    Pow,
}

/// Names of functions of one number. `log`, `Abs` are as SymPy writes them.
const FUNCTIONS: &[(&str, Function)] = &[
    ("sqrt", Function::Sqrt),
    ("sqr", Function::Sqr),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tan", Function::Tan),
    ("asin", Function::Asin),
    ("acos", Function::Acos),
    ("atan", Function::Atan),
    ("exp", Function::Exp),
    ("exp_m1", Function::ExpM1),
    ("expm1", Function::ExpM1),
    ("ln", Function::Ln),
    ("log", Function::Ln),
    ("log10", Function::Log10),
    ("ln_1p", Function::Ln1p),
    ("log1p", Function::Ln1p),
    ("sinh", Function::Sinh),
    ("cosh", Function::Cosh),
    ("tanh", Function::Tanh),
    ("asinh", Function::Asinh),
    ("abs", Function::Abs),
    ("Abs", Function::Abs),
];

/// Names of functions of two numbers or more.
const PAIRINGS: &[(&str, Pairing)] = &[
    ("atan2", Pairing::Atan2),
    ("hypot", Pairing::Hypot),
    ("min", Pairing::Min),
    ("Min", Pairing::Min),
    ("max", Pairing::Max),
    ("Max", Pairing::Max),
    ("pow", Pairing::Pow),
];

/// Names that mean a number: π, e, the step and the time.
pub const CONSTANTS: &[&str] = &["pi", "E", "k", "t"];

/// All names that nothing else may have.
pub fn reserved() -> impl Iterator<Item = &'static str> {
    let functions = FUNCTIONS.iter().map(|(name, _)| *name);
    let pairings = PAIRINGS.iter().map(|(name, _)| *name);
    functions.chain(pairings).chain(CONSTANTS.iter().copied())
}

/// True for a letter or `_`, followed by letters, digits and `_`.
pub fn is_name(text: &str) -> bool {
    let mut bytes = text.bytes();
    bytes
        .next()
        .is_some_and(|b| b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// A term; operands are places in the list that it stands in, all before its own.
#[derive(Clone, Debug, PartialEq)]
pub enum Term {
    /// A number.
    Number(f64),
    /// A name.
    Name(String),
    /// −a
    Neg(usize),
    /// a + b
    Add(usize, usize),
    /// a − b
    Sub(usize, usize),
    /// a · b
    Mul(usize, usize),
    /// a / b
    Div(usize, usize),
    /// a^b
    Power(usize, usize),
    /// f(a)
    Call(Function, usize),
    /// f(a, b)
    Pair(Pairing, usize, usize),
}

/// A text as terms; the last one is the whole.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Terms {
    /// Each term and its bytes in the text.
    pub list: Vec<(Term, Range<usize>)>,
}

/// Reads `text`.
pub fn parse(text: &str) -> Result<Terms, Wrong> {
    if text.len() > LARGEST_TEXT {
        let got = format!("{} bytes", text.len());
        return Err(Wrong::new(
            0..0,
            format!("at most {LARGEST_TEXT} bytes"),
            got,
        ));
    }
    let mut parser = Parser {
        text,
        at: 0,
        terms: Terms::default(),
    };
    parser.expression(0, 0)?;
    parser.space();
    if parser.at < text.len() {
        return Err(parser.unexpected("an operator or the end"));
    }
    Ok(parser.terms)
}

/// An operator: its length, how strongly it binds to the left and to the right, and its term.
type Operator = (usize, u8, u8, fn(usize, usize) -> Term);

struct Parser<'a> {
    text: &'a str,
    at: usize,
    terms: Terms,
}

/// How strongly a sign binds what follows it: less than a power, more than a product.
const SIGN: u8 = 5;

impl Parser<'_> {
    fn space(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    fn peek(&mut self) -> Option<u8> {
        self.space();
        self.text.as_bytes().get(self.at).copied()
    }

    /// A fault at what comes next.
    fn unexpected(&mut self, expected: &str) -> Wrong {
        self.space();
        match self.text[self.at..].chars().next() {
            None => Wrong::new(self.at..self.at, expected, "the end"),
            Some(c) => Wrong::new(self.at..self.at + c.len_utf8(), expected, format!("{c:?}")),
        }
    }

    fn push(&mut self, term: Term, from: usize) -> usize {
        // The blanks before the next token have been passed.
        let end = from + self.text[from..self.at].trim_ascii_end().len();
        self.terms.list.push((term, from..end));
        self.terms.list.len() - 1
    }

    fn eat(&mut self, byte: u8, expected: &str) -> Result<(), Wrong> {
        if self.peek() == Some(byte) {
            self.at += 1;
            Ok(())
        } else {
            Err(self.unexpected(expected))
        }
    }

    /// An operand and all operators that bind at least as strongly as `least`.
    fn expression(&mut self, least: u8, depth: usize) -> Result<usize, Wrong> {
        self.space();
        let from = self.at;
        if depth > LARGEST_DEPTH {
            let expected = format!("at most {LARGEST_DEPTH} levels of nesting");
            return Err(Wrong::new(from..from + 1, expected, "more"));
        }
        let mut left = self.operand(depth)?;
        loop {
            let Some((length, binds, right_binds, make)) = self.operator() else {
                return Ok(left);
            };
            if binds < least {
                return Ok(left);
            }
            self.at += length;
            let right = self.expression(right_binds, depth + 1)?;
            left = self.push(make(left, right), from);
        }
    }

    /// The operator that comes next.
    fn operator(&mut self) -> Option<Operator> {
        let next = self.peek()?;
        let doubled = self.text.as_bytes().get(self.at + 1) == Some(&b'*');
        Some(match next {
            b'+' => (1, 1, 2, Term::Add),
            b'-' => (1, 1, 2, Term::Sub),
            b'*' if doubled => (2, 8, 7, Term::Power),
            b'*' => (1, 3, 4, Term::Mul),
            b'/' => (1, 3, 4, Term::Div),
            b'^' => (1, 8, 7, Term::Power),
            _ => return None,
        })
    }

    fn operand(&mut self, depth: usize) -> Result<usize, Wrong> {
        let from = self.at;
        match self.peek() {
            Some(b'-') => {
                self.at += 1;
                let of = self.expression(SIGN, depth + 1)?;
                Ok(self.push(Term::Neg(of), from))
            }
            Some(b'+') => {
                self.at += 1;
                self.expression(SIGN, depth + 1)
            }
            Some(b'(') => {
                self.at += 1;
                let inside = self.expression(0, depth + 1)?;
                self.eat(b')', "an operator or `)`")?;
                Ok(inside)
            }
            Some(b'0'..=b'9' | b'.') => self.number(),
            Some(b) if b.is_ascii_alphabetic() || b == b'_' => self.name(depth),
            _ => Err(self.unexpected("a number, a name, a sign or `(`")),
        }
    }

    fn number(&mut self) -> Result<usize, Wrong> {
        let bytes = self.text.as_bytes();
        let from = self.at;
        let digits = |mut at: usize| {
            while bytes.get(at).is_some_and(u8::is_ascii_digit) {
                at += 1;
            }
            at
        };
        let mut at = digits(from);
        if bytes.get(at) == Some(&b'.') {
            at = digits(at + 1);
        }
        if matches!(bytes.get(at), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
            if bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
                at = digits(at + 1 + sign);
            }
        }
        self.at = at;
        let text = &self.text[from..at];
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(self.push(Term::Number(x), from)),
            _ => Err(Wrong::new(from..at, "a number", format!("{text:?}"))),
        }
    }

    /// A name, or a function with its arguments.
    fn name(&mut self, depth: usize) -> Result<usize, Wrong> {
        let from = self.at;
        let rest = &self.text.as_bytes()[from..];
        let length = rest
            .iter()
            .take_while(|b| b.is_ascii_alphanumeric() || **b == b'_')
            .count();
        self.at += length;
        let name = &self.text[from..self.at];
        let own = from..self.at;
        if self.peek() != Some(b'(') {
            self.at = own.end;
            if FUNCTIONS.iter().any(|(f, _)| *f == name) || PAIRINGS.iter().any(|(f, _)| *f == name)
            {
                let expected = format!("`(` after the function {name}");
                return Err(self.unexpected(&expected));
            }
            return Ok(self.push(Term::Name(name.to_owned()), from));
        }
        let one = FUNCTIONS.iter().find(|(f, _)| *f == name);
        let two = PAIRINGS.iter().find(|(f, _)| *f == name);
        if one.is_none() && two.is_none() {
            let known = FUNCTIONS
                .iter()
                .map(|(f, _)| *f)
                .chain(PAIRINGS.iter().map(|(f, _)| *f));
            return Err(Wrong {
                known: known.map(str::to_owned).collect(),
                ..Wrong::new(own, "a function", format!("{name:?}"))
            });
        }
        self.at += 1;
        let mut arguments = vec![self.expression(0, depth + 1)?];
        while self.peek() == Some(b',') {
            self.at += 1;
            arguments.push(self.expression(0, depth + 1)?);
        }
        self.eat(b')', "`,` or `)`")?;
        let arity = |wanted: &str, n: usize| {
            let got = if n == 1 {
                "1 argument".to_owned()
            } else {
                format!("{n} arguments")
            };
            Wrong::new(from..self.at, format!("{wanted} of {name}"), got)
        };
        match (one, two, arguments.as_slice()) {
            (Some((_, function)), _, [a]) => Ok(self.push(Term::Call(*function, *a), from)),
            (Some(_), _, more) => Err(arity("1 argument", more.len())),
            (_, Some((_, pairing)), [a, b]) => Ok(self.push(Term::Pair(*pairing, *a, *b), from)),
            (_, Some((_, pairing @ (Pairing::Min | Pairing::Max))), [a, rest @ ..])
                if !rest.is_empty() =>
            {
                let mut least = *a;
                for b in rest {
                    least = self.push(Term::Pair(*pairing, least, *b), from);
                }
                Ok(least)
            }
            (_, _, wrong) => Err(arity("2 arguments", wrong.len())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value of a text of numbers.
    fn value(text: &str) -> f64 {
        let terms = parse(text).unwrap_or_else(|wrong| panic!("{text}: {wrong:?}"));
        let mut values: Vec<f64> = Vec::new();
        for (term, _) in &terms.list {
            let v = |i: &usize| values[*i];
            values.push(match term {
                Term::Number(x) => *x,
                Term::Neg(a) => -v(a),
                Term::Add(a, b) => v(a) + v(b),
                Term::Sub(a, b) => v(a) - v(b),
                Term::Mul(a, b) => v(a) * v(b),
                Term::Div(a, b) => v(a) / v(b),
                Term::Power(a, b) => libm::pow(v(a), v(b)),
                other => panic!("{other:?}"),
            });
        }
        *values.last().unwrap()
    }

    #[test]
    fn operators_bind_as_on_paper() {
        for (text, expected) in [
            ("1 + 2*3", 7.0),
            ("(1 + 2)*3", 9.0),
            ("8 - 3 - 2", 3.0),
            ("8/4/2", 1.0),
            ("-3^2", -9.0),
            ("(-3)^2", 9.0),
            ("2^3^2", 512.0),
            ("2**3**2", 512.0),
            ("2^-1*3", 1.5),
            ("2*-3", -6.0),
            ("- -3", 3.0),
            ("+3", 3.0),
            ("1e-3", 1e-3),
            (".5 + 1.", 1.5),
            ("1.5E+2", 150.0),
        ] {
            assert_eq!(value(text), expected, "{text}");
        }
    }

    #[test]
    fn a_mistake_is_answered_at_its_place() {
        for (text, at, expected, got) in [
            ("", 0, "a number, a name, a sign or `(`", "the end"),
            ("1 +", 3, "a number, a name, a sign or `(`", "the end"),
            ("a b", 2, "an operator or the end", "'b'"),
            ("(a", 2, "an operator or `)`", "the end"),
            ("a)", 1, "an operator or the end", "')'"),
            ("2 * ×", 4, "a number, a name, a sign or `(`", "'×'"),
            ("sinn(a)", 0, "a function", "\"sinn\""),
            ("sin(a, b)", 0, "1 argument of sin", "2 arguments"),
            ("atan2(a)", 0, "2 arguments of atan2", "1 argument"),
            ("max(a)", 0, "2 arguments of max", "1 argument"),
            ("sin a", 4, "`(` after the function sin", "'a'"),
            ("1e999", 0, "a number", "\"1e999\""),
            (".", 0, "a number", "\".\""),
            ("a ^", 3, "a number, a name, a sign or `(`", "the end"),
            ("a[1]", 1, "an operator or the end", "'['"),
        ] {
            let wrong = parse(text).unwrap_err();
            assert_eq!(
                (wrong.range.start, &*wrong.expected, &*wrong.got),
                (at, expected, got),
                "{text}"
            );
        }
    }

    #[test]
    fn nesting_is_bounded_and_length_is_not_nesting() {
        let deep = format!("{}1{}", "(".repeat(10_000), ")".repeat(10_000));
        assert!(parse(&deep).unwrap_err().expected.contains("nesting"));
        assert!(
            parse(&"-".repeat(10_000))
                .unwrap_err()
                .expected
                .contains("nesting")
        );
        let long = vec!["1"; 100_000].join(" + ");
        assert_eq!(value(&long), 100_000.0);
        assert!(
            parse(&"1 + ".repeat(300_000))
                .unwrap_err()
                .expected
                .contains("bytes")
        );
    }
}
