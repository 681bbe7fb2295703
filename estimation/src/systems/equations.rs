//! A system that is written as equations: x⁺ = next(x, u, w, k), y = output(x, u, v, k), or ẋ = rate(x, u, w, t).
//!
//! The texts are read once into tapes that evaluate on every number, so that enclosures and derivatives follow from the
//! text alone. What is guaranteed is about the discrete model: with `rate`, about the method's step and not about the
//! differential equation.

mod insight;
mod syntax;
mod tape;

use super::Linear;
use crate::system::{LinearParts, QuasiLpv, System, Variable, Variables};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use syntax::{Terms, Wrong};
use tape::{Coefficients, Scalar, Tape, Value, Writer};
use zonobench_sets::number::Real;
use zonobench_sets::{Interval, IntervalVector, Matrix};

pub use insight::{Dependence, Term};
pub use syntax::{LARGEST_DEPTH, LARGEST_TEXT, is_name};
pub use tape::LARGEST_TAPE;

/// Names with their units, in order.
pub type Named = Vec<(String, String)>;

/// Names with their equations, in order.
pub type Texts = Vec<(String, String)>;

/// How a rate becomes a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// x + h r(x).
    #[default]
    Euler,
    /// x + h/2 (k₁ + k₂), k₁ = r(x), k₂ = r(x + h k₁).
    Heun,
    /// x + h/6 (k₁ + 2 k₂ + 2 k₃ + k₄), the classical method of Runge and Kutta.
    Rk4,
}

/// How the state moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// x⁺ of every component.
    Next(Texts),
    /// ẋ of every component; u and w are constant over a step.
    Rate {
        /// ẋ
        equations: Texts,
        /// How a step is made of it
        method: Method,
        /// Steps of the method in one step of k
        substeps: usize,
    },
}

/// What a user writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// State.
    pub x: Named,
    /// Input.
    pub u: Named,
    /// Process noise.
    pub w: Named,
    /// Measurement.
    pub y: Named,
    /// Measurement noise.
    pub v: Named,
    /// Names for numbers.
    pub parameters: Vec<(String, f64)>,
    /// Names for expressions; each may use those before it.
    pub definitions: Texts,
    /// How the state moves.
    pub motion: Motion,
    /// y of every component.
    pub output: Texts,
    /// Time from step to step in s.
    pub period: Option<f64>,
}

/// Which part of a [`Source`] is wrong.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A table of names: `x`, `let`, `next`, …
    Table(&'static str),
    /// A name in a table.
    Name(&'static str, String),
    /// The text of a name in a table, at these bytes.
    Text(&'static str, String, Range<usize>),
}

/// What is wrong with a [`Source`].
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Where.
    pub part: Part,
    /// What was expected.
    pub expected: Box<str>,
    /// What came.
    pub got: Box<str>,
    /// Names that there are, where one was not found.
    pub known: Box<[String]>,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.part {
            Part::Table(table) => write!(f, "{table}")?,
            Part::Name(table, name) => write!(f, "{table}.{name}")?,
            Part::Text(table, name, range) => {
                write!(f, "{table}.{name}, column {}", range.start + 1)?
            }
        }
        write!(f, ": expected {}, got {}", self.expected, self.got)
    }
}

impl std::error::Error for Fault {}

/// A system that is written as equations.
///
/// Where `next` and `output` are linear, with w and v added to every component, it *is* that linear system: its coefficients
/// are computed once in f64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Source", into = "Source")]
pub struct Equations(Arc<Read>);

/// A source that was read.
#[derive(Debug, PartialEq)]
struct Read {
    source: Source,
    next: Tape,
    output: Tape,
    linear: Option<Linear>,
    /// (table, name) of every text, by the numbers in the tapes' origins.
    texts: Vec<(&'static str, String)>,
    warnings: Vec<Fault>,
}

impl From<Equations> for Source {
    fn from(equations: Equations) -> Self {
        equations.0.source.clone()
    }
}

impl TryFrom<Source> for Equations {
    type Error = Fault;
    fn try_from(source: Source) -> Result<Self, Fault> {
        Self::new(source)
    }
}

impl Equations {
    /// Reads the equations.
    ///
    /// Fails at the first mistake, with its place: a name that is not one or stands twice, an unknown name, a wrong number
    /// of arguments, a component without an equation, a constant that is no finite number, too many operations.
    pub fn new(source: Source) -> Result<Self, Fault> {
        let reader = Reader::new(&source)?;
        let (next, output) = (reader.next()?, reader.output()?);
        reader.check_unused()?;
        let linear = linear(&source, &next, &output);
        let (texts, warnings) = (reader.names(), reader.warnings());
        Ok(Self(Arc::new(Read {
            next,
            output,
            linear,
            texts,
            warnings,
            source,
        })))
    }

    /// What was written.
    pub fn source(&self) -> &Source {
        &self.0.source
    }

    /// What is right and perhaps not meant: `x*x` where `x^2` is tighter, a name that no equation uses, a state that
    /// keeps its first value.
    pub fn warnings(&self) -> &[Fault] {
        &self.0.warnings
    }

    /// Operations of a step, and of a measurement.
    pub fn operations(&self) -> (usize, usize) {
        (self.0.next.len(), self.0.output.len())
    }

    /// The system as a [`Linear`] one, where it is.
    pub fn as_linear(&self) -> Option<&Linear> {
        self.0.linear.as_ref()
    }
}

impl System for Equations {
    fn variables(&self) -> Variables {
        let of = |names: &Named| {
            names
                .iter()
                .map(|(name, unit)| Variable::new(name, unit.clone()))
                .collect()
        };
        Variables {
            x: of(&self.0.source.x),
            u: of(&self.0.source.u),
            w: of(&self.0.source.w),
            y: of(&self.0.source.y),
            v: of(&self.0.source.v),
        }
    }

    fn f<S: Real>(&self, k: usize, x: &[S], u: &[f64], w: &[S], next: &mut [S]) {
        match &self.0.linear {
            Some(linear) => linear.f(k, x, u, w, next),
            None => self.0.next.evaluate(k, x, u, w, next),
        }
    }

    fn h<S: Real>(&self, k: usize, x: &[S], u: &[f64], v: &[S], y: &mut [S]) {
        match &self.0.linear {
            Some(linear) => linear.h(k, x, u, v, y),
            None => self.0.output.evaluate(k, x, u, v, y),
        }
    }

    fn kind(&self) -> &'static str {
        "equations"
    }

    fn period(&self) -> Option<f64> {
        self.0.source.period
    }

    fn measures_input(&self) -> bool {
        self.0.output.reads_input()
    }

    fn linear_parts(&self) -> Option<LinearParts> {
        self.0.linear.as_ref().map(Linear::parts)
    }

    fn linear_output(&self) -> Option<(Matrix, Matrix)> {
        if let Some(linear) = &self.0.linear {
            return linear.linear_output();
        }
        let Source { x, y, v, .. } = &self.0.source;
        let (rows, exact) = self.0.output.linear()?;
        let of =
            |from: usize, n: usize| Matrix::from_fn(y.len(), n, |i, j| entry(&rows[i], from + j));
        exact.then(|| (of(0, x.len()), of(x.len(), v.len())))
    }

    fn domain_fault(&self, x: &IntervalVector) -> Option<String> {
        let over: Vec<Interval> = x.iter().copied().collect();
        let tapes = [&self.0.next, &self.0.output];
        let fault = tapes
            .into_iter()
            .find_map(|tape| tape.domain_fault(&over))?;
        let (text, range) = &fault.origin;
        let (table, name) = &self.0.texts[*text];
        let written = self
            .0
            .source
            .text(table, name)
            .and_then(|t| t.get(range.clone()))
            .unwrap_or_default();
        let of: Vec<String> = fault
            .arguments
            .iter()
            .filter_map(|&i| {
                Some(format!(
                    "{} in [{}, {}]",
                    self.0.source.x.get(i)?.0,
                    x[i].lo(),
                    x[i].hi()
                ))
            })
            .collect();
        let (lo, hi) = (fault.operand.lo(), fault.operand.hi());
        Some(format!(
            "`{written}` in {table}.{name}, column {}, needs {}, and over the set it is in [{lo}, {hi}] ({})",
            range.start + 1,
            fault.needs,
            of.join(", ")
        ))
    }

    fn quasi_lpv(&self) -> Option<&dyn QuasiLpv> {
        self.as_linear().map(|linear| linear as &dyn QuasiLpv)
    }
}

impl Source {
    fn motion(&self) -> (&'static str, &Texts) {
        match &self.motion {
            Motion::Next(equations) => ("next", equations),
            Motion::Rate { equations, .. } => ("rate", equations),
        }
    }

    /// The text of `name` in `table`.
    fn text(&self, table: &str, name: &str) -> Option<&str> {
        let texts = match table {
            "let" => &self.definitions,
            "output" => &self.output,
            _ => self.motion().1,
        };
        texts
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, text)| text.as_str())
    }
}

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    State(usize),
    Input(usize),
    /// Of the process
    Noise(usize),
    /// Of the measurement
    Error(usize),
    Parameter(f64),
    Definition(usize),
}

/// Which noise a text may name.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Motion,
    Output,
}

/// A source whose names are in order and whose texts are read.
struct Reader<'a> {
    source: &'a Source,
    meanings: HashMap<&'a str, Meaning>,
    definitions: Vec<Terms>,
    motion: Vec<Terms>,
    output: Vec<Terms>,
}

fn table_fault(part: Part, expected: impl Into<Box<str>>, got: impl Into<Box<str>>) -> Fault {
    Fault {
        part,
        expected: expected.into(),
        got: got.into(),
        known: Box::default(),
    }
}

impl<'a> Reader<'a> {
    fn new(source: &'a Source) -> Result<Self, Fault> {
        let mut meanings = HashMap::new();
        if source.x.is_empty() {
            return Err(table_fault(Part::Table("x"), "at least one state", "none"));
        }
        let period = source.period;
        if period.is_some_and(|p| !(p.is_finite() && p > 0.0)) {
            let got = format!("{:?}", period.unwrap_or_default());
            return Err(table_fault(
                Part::Table("period"),
                "a finite number above 0",
                got,
            ));
        }
        if let Motion::Rate { substeps, .. } = source.motion {
            if period.is_none() {
                return Err(table_fault(
                    Part::Table("period"),
                    "the time from step to step in s beside rate",
                    "nothing",
                ));
            }
            if substeps == 0 {
                return Err(table_fault(
                    Part::Table("substeps"),
                    "an integer of at least 1",
                    "0",
                ));
            }
        }
        for (table, n) in [
            ("x", source.x.len()),
            ("u", source.u.len()),
            ("w", source.w.len()),
            ("y", source.y.len()),
            ("v", source.v.len()),
            ("parameters", source.parameters.len()),
            ("let", source.definitions.len()),
        ] {
            if n > LARGEST_TAPE {
                return Err(table_fault(
                    Part::Table(table),
                    format!("at most {LARGEST_TAPE} names"),
                    n.to_string(),
                ));
            }
        }
        type Vector<'a> = (&'static str, &'a Named, fn(usize) -> Meaning);
        let vectors: [Vector; 4] = [
            ("x", &source.x, Meaning::State),
            ("u", &source.u, Meaning::Input),
            ("w", &source.w, Meaning::Noise),
            ("v", &source.v, Meaning::Error),
        ];
        for (table, names, meaning) in vectors {
            for (i, (name, _)) in names.iter().enumerate() {
                define(&mut meanings, table, name, meaning(i))?;
            }
        }
        for (name, value) in &source.parameters {
            if !value.is_finite() {
                let part = Part::Name("parameters", name.clone());
                return Err(table_fault(part, "a finite number", format!("{value:?}")));
            }
            define(
                &mut meanings,
                "parameters",
                name,
                Meaning::Parameter(*value),
            )?;
        }
        for (i, (name, _)) in source.definitions.iter().enumerate() {
            define(&mut meanings, "let", name, Meaning::Definition(i))?;
        }
        let mut outputs = HashMap::new();
        for (i, (name, _)) in source.y.iter().enumerate() {
            define(&mut outputs, "y", name, Meaning::State(i))?;
        }
        let (table, motion) = source.motion();
        Ok(Self {
            source,
            meanings,
            definitions: read("let", &source.definitions)?,
            motion: one_each(table, &source.x, motion)?,
            output: one_each("output", &source.y, &source.output)?,
        })
    }

    /// (table, name) of every text: `let`, then the motion, then the output.
    fn names(&self) -> Vec<(&'static str, String)> {
        let (table, _) = self.source.motion();
        let of = |table: &'static str, names: &[(String, String)]| -> Vec<(&'static str, String)> {
            names
                .iter()
                .map(|(name, _)| (table, name.clone()))
                .collect()
        };
        [
            of("let", &self.source.definitions),
            of(table, &self.source.x),
            of("output", &self.source.y),
        ]
        .concat()
    }

    /// x⁺ as a tape over x and w.
    fn next(&self) -> Result<Tape, Fault> {
        let source = self.source;
        let n = source.x.len();
        let mut writer = Writer::new(n + source.w.len(), source.period.unwrap_or(0.0));
        let mut x: Vec<Value> = (0..n).map(|i| Value::Register(i as u32)).collect();
        match source.motion {
            Motion::Next(_) => x = self.all(&mut writer, &self.motion, n, &x, Side::Motion, 0.0)?,
            Motion::Rate {
                method, substeps, ..
            } => {
                let h = source.period.unwrap_or(0.0) / substeps as f64;
                for step in 0..substeps {
                    x = self.step(&mut writer, method, &x, h, step as f64 * h)?;
                }
            }
        }
        Ok(writer.finish(x))
    }

    /// One step of the method from `x`, `since` seconds after the time k · period.
    fn step(
        &self,
        writer: &mut Writer,
        method: Method,
        x: &[Value],
        h: f64,
        since: f64,
    ) -> Result<Vec<Value>, Fault> {
        let n = x.len();
        let rate = |writer: &mut Writer, x: &[Value], at: f64| {
            self.all(writer, &self.motion, n, x, Side::Motion, at)
        };
        // x + h r for a factor h.
        let along = |writer: &mut Writer, r: &[Value], h: f64| -> Result<Vec<Value>, Fault> {
            let moved = x.iter().zip(r).enumerate().map(|(i, (x, r))| {
                let origin = self.origin(i);
                let step = writer
                    .mul(*r, Value::constant(h), &origin)
                    .map_err(|w| self.fault(&origin, w))?;
                writer
                    .add(*x, step, &origin)
                    .map_err(|w| self.fault(&origin, w))
            });
            moved.collect()
        };
        let sum = |writer: &mut Writer,
                   a: &[Value],
                   b: &[Value],
                   twice: bool|
         -> Result<Vec<Value>, Fault> {
            let summed = a.iter().zip(b).enumerate().map(|(i, (a, b))| {
                let origin = self.origin(i);
                let wrong = |w| self.fault(&origin, w);
                let factor = Value::constant(if twice { 2.0 } else { 1.0 });
                let b = if twice {
                    writer.mul(*b, factor, &origin).map_err(wrong)?
                } else {
                    *b
                };
                writer.add(*a, b, &origin).map_err(wrong)
            });
            summed.collect()
        };
        let k1 = rate(writer, x, since)?;
        match method {
            Method::Euler => along(writer, &k1, h),
            Method::Heun => {
                let there = along(writer, &k1, h)?;
                let k2 = rate(writer, &there, since + h)?;
                let both = sum(writer, &k1, &k2, false)?;
                along(writer, &both, h / 2.0)
            }
            Method::Rk4 => {
                let half = along(writer, &k1, h / 2.0)?;
                let k2 = rate(writer, &half, since + h / 2.0)?;
                let half = along(writer, &k2, h / 2.0)?;
                let k3 = rate(writer, &half, since + h / 2.0)?;
                let there = along(writer, &k3, h)?;
                let k4 = rate(writer, &there, since + h)?;
                let all = sum(writer, &k1, &k2, true)?;
                let all = sum(writer, &all, &k3, true)?;
                let all = sum(writer, &all, &k4, false)?;
                along(writer, &all, h / 6.0)
            }
        }
    }

    /// Where the text of state `i` stands, for an operation that the method adds.
    fn origin(&self, i: usize) -> tape::Origin {
        (self.definitions.len() + i, 0..0)
    }

    /// y as a tape over x and v.
    fn output(&self) -> Result<Tape, Fault> {
        let source = self.source;
        let n = source.x.len();
        let mut writer = Writer::new(n + source.v.len(), source.period.unwrap_or(0.0));
        let x: Vec<Value> = (0..n).map(|i| Value::Register(i as u32)).collect();
        let y = self.all(&mut writer, &self.output, n, &x, Side::Output, 0.0)?;
        Ok(writer.finish(y))
    }

    /// The values of `texts` at the state `x`, `since` seconds after the time k · period.
    fn all(
        &self,
        writer: &mut Writer,
        texts: &[Terms],
        n: usize,
        x: &[Value],
        side: Side,
        since: f64,
    ) -> Result<Vec<Value>, Fault> {
        let base = match side {
            Side::Motion => self.definitions.len(),
            Side::Output => self.definitions.len() + self.motion.len(),
        };
        // A definition is written when a text names it; one that has the other side's noise is a fault only then.
        let mut defined: Vec<Option<Value>> = vec![None; self.definitions.len()];
        for i in self.named(texts) {
            let value = self.write(writer, i, &self.definitions[i], n, x, side, since, &defined)?;
            defined[i] = Some(value);
        }
        texts
            .iter()
            .enumerate()
            .map(|(i, terms)| self.write(writer, base + i, terms, n, x, side, since, &defined))
            .collect()
    }

    /// The definitions that `texts` name, and those that these name, in order.
    fn named(&self, texts: &[Terms]) -> Vec<usize> {
        let mut wanted = vec![false; self.definitions.len()];
        let mark = |terms: &Terms, wanted: &mut Vec<bool>| {
            for i in self.definitions_of(terms) {
                wanted[i] = true;
            }
        };
        texts.iter().for_each(|terms| mark(terms, &mut wanted));
        for i in (0..self.definitions.len()).rev() {
            if wanted[i] {
                mark(&self.definitions[i], &mut wanted);
            }
        }
        (0..wanted.len()).filter(|i| wanted[*i]).collect()
    }

    #[allow(
        clippy::too_many_arguments,
        reason = "the place, the point and what is known there"
    )]
    fn write(
        &self,
        writer: &mut Writer,
        text: usize,
        terms: &Terms,
        n: usize,
        x: &[Value],
        side: Side,
        since: f64,
        defined: &[Option<Value>],
    ) -> Result<Value, Fault> {
        let of_name = |name: &str, range: &Range<usize>| {
            let wrong = |expected: String| Wrong {
                known: self.known(),
                ..Wrong::new(range.clone(), expected, format!("{name:?}"))
            };
            match (self.meanings.get(name), side) {
                (Some(Meaning::State(i)), _) => Ok(x[*i]),
                (Some(Meaning::Input(i)), _) => Ok(Value::Scalar(Scalar::Input(*i as u32))),
                (Some(Meaning::Noise(i)), Side::Motion)
                | (Some(Meaning::Error(i)), Side::Output) => Ok(Value::Register((n + i) as u32)),
                (Some(Meaning::Noise(_)), _) => {
                    Err(wrong("no noise of the process in an output".into()))
                }
                (Some(Meaning::Error(_)), _) => Err(wrong(
                    "no noise of the measurement in an equation of motion".into(),
                )),
                (Some(Meaning::Parameter(p)), _) => Ok(Value::constant(*p)),
                (Some(Meaning::Definition(i)), _) => {
                    defined[*i].ok_or_else(|| self.not_above(text, *i, range))
                }
                (None, _) => match name {
                    "pi" => Ok(Value::constant(std::f64::consts::PI)),
                    "E" => Ok(Value::constant(std::f64::consts::E)),
                    "k" => Ok(Value::Scalar(Scalar::Step)),
                    "t" if self.source.period.is_some() => Ok(Value::Scalar(Scalar::time(since))),
                    "t" => Err(Wrong::new(
                        range.clone(),
                        "a period beside the time t",
                        "none",
                    )),
                    _ => Err(wrong("a name that the system has".into())),
                },
            }
        };
        writer
            .write(text, terms, of_name)
            .map_err(|wrong| self.fault(&(text, 0..0), wrong))
    }

    /// The fault of definition `text` that names definition `i`, which does not stand above it: in a circle, or below.
    fn not_above(&self, text: usize, i: usize, range: &Range<usize>) -> Wrong {
        let name = |i: usize| self.source.definitions[i].0.as_str();
        match self.path(i, text) {
            Some(path) => {
                let circle: Vec<&str> = [text].iter().chain(&path).map(|i| name(*i)).collect();
                let got = format!("{} in a circle", circle.join(" -> "));
                Wrong::new(range.clone(), "a definition that does not need itself", got)
            }
            None => {
                let got = format!("{:?}, which stands below it", name(i));
                Wrong::new(range.clone(), "a name that stands above it in let", got)
            }
        }
    }

    /// Definitions from `from` to `to`, each of which names the next.
    fn path(&self, from: usize, to: usize) -> Option<Vec<usize>> {
        let mut before: Vec<Option<usize>> = vec![None; self.definitions.len()];
        let mut open = vec![from];
        let mut seen = vec![false; self.definitions.len()];
        while let Some(at) = open.pop() {
            if at == to {
                let mut path = vec![to];
                while let Some(previous) = path.last().and_then(|last| before[*last]) {
                    path.push(previous);
                }
                path.reverse();
                return Some(path);
            }
            if std::mem::replace(&mut seen[at], true) {
                continue;
            }
            for i in self.definitions_of(&self.definitions[at]) {
                if !seen[i] {
                    before[i] = Some(at);
                    open.push(i);
                }
            }
        }
        None
    }

    /// The definitions that a text names.
    fn definitions_of(&self, terms: &Terms) -> Vec<usize> {
        let of = |(term, _): &(syntax::Term, Range<usize>)| match term {
            syntax::Term::Name(name) => match self.meanings.get(name.as_str()) {
                Some(Meaning::Definition(i)) => Some(*i),
                _ => None,
            },
            _ => None,
        };
        terms.list.iter().filter_map(of).collect()
    }

    fn known(&self) -> Vec<String> {
        let mut known: Vec<String> = self
            .meanings
            .keys()
            .map(|name| (*name).to_owned())
            .collect();
        known.extend(syntax::CONSTANTS.iter().map(|c| (*c).to_owned()));
        known.sort();
        known
    }

    fn fault(&self, origin: &tape::Origin, wrong: Wrong) -> Fault {
        let (table, name) = self.names().swap_remove(origin.0);
        in_text(table, &name, wrong)
    }
}

fn in_text(table: &'static str, name: &str, wrong: Wrong) -> Fault {
    Fault {
        part: Part::Text(table, name.to_owned(), wrong.range),
        expected: wrong.expected.into(),
        got: wrong.got.into(),
        known: wrong.known.into(),
    }
}

/// Gives `name` a meaning; it has to be a name, and to have none yet.
fn define<'a>(
    meanings: &mut HashMap<&'a str, Meaning>,
    table: &'static str,
    name: &'a str,
    meaning: Meaning,
) -> Result<(), Fault> {
    let part = || Part::Name(table, name.to_owned());
    if !is_name(name) {
        let expected = "a name of letters, digits and _ that begins with no digit";
        return Err(table_fault(part(), expected, format!("{name:?}")));
    }
    if syntax::reserved().any(|r| r == name) {
        let expected = "a name that is no function and none of pi, E, k, t";
        return Err(table_fault(part(), expected, format!("{name:?}")));
    }
    if meanings.insert(name, meaning).is_some() {
        return Err(table_fault(
            part(),
            "a name that stands once",
            format!("{name:?} twice"),
        ));
    }
    Ok(())
}

fn read(table: &'static str, texts: &Texts) -> Result<Vec<Terms>, Fault> {
    let one = |(name, text): &(String, String)| {
        syntax::parse(text).map_err(|wrong| in_text(table, name, wrong))
    };
    texts.iter().map(one).collect()
}

/// The texts of `names`, in their order: each has one, and nothing else has.
fn one_each(table: &'static str, names: &Named, texts: &Texts) -> Result<Vec<Terms>, Fault> {
    let known = || -> Vec<String> { names.iter().map(|(name, _)| name.clone()).collect() };
    if let Some((unknown, _)) = texts
        .iter()
        .find(|(name, _)| names.iter().all(|(n, _)| n != name))
    {
        return Err(Fault {
            known: known().into(),
            ..table_fault(
                Part::Name(table, unknown.clone()),
                format!("an equation for one of {}", known().join(", ")),
                format!("one for {unknown:?}"),
            )
        });
    }
    let in_order: Texts = names
        .iter()
        .map(|(name, _)| {
            let text = texts.iter().find(|(n, _)| n == name);
            text.cloned().ok_or_else(|| {
                table_fault(
                    Part::Table(table),
                    format!("an equation for {name:?}"),
                    "none",
                )
            })
        })
        .collect::<Result<_, _>>()?;
    read(table, &in_order)
}

/// The linear system that the tapes are, if they are: w and v added, one to every component.
fn linear(source: &Source, next: &Tape, output: &Tape) -> Option<Linear> {
    let (n, m, p) = (source.x.len(), source.y.len(), source.u.len());
    if source.w.len() != n || source.v.len() != m {
        return None;
    }
    let ((f, _), (h, _)) = (next.linear()?, output.linear()?);
    let is_added = |rows: &[Coefficients]| {
        let one = |i, j| if i == j { 1.0 } else { 0.0 };
        (0..rows.len()).all(|i| (0..rows.len()).all(|j| entry(&rows[i], n + j) == one(i, j)))
    };
    if !(is_added(&f) && is_added(&h)) {
        return None;
    }
    let a = Matrix::from_fn(n, n, |i, j| entry(&f[i], j));
    let b = Matrix::from_fn(n, p, |i, j| entry(&f[i], 2 * n + j));
    let c = Matrix::from_fn(m, n, |i, j| entry(&h[i], j));
    let d = Matrix::from_fn(m, p, |i, j| entry(&h[i], n + m + j));
    Linear::new(a, Some(b), c, Some(d)).ok()
}

fn entry(row: &Coefficients, j: usize) -> f64 {
    row.get(&j).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
