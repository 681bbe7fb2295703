//! Equations as a tape: operations in order, each on results of earlier ones, evaluated on any number.
//!
//! Operations are those of [`Real`], in the order in which the text has them: nothing is rewritten, because the form decides
//! how wide an enclosure is. Two things are done: an operation on numbers and parameters alone is computed once where its
//! result is an f64 exactly (elsewhere it is evaluated with the rest, so that its rounding is enclosed too), and an operation
//! that stands twice is done once. An operation of a number with a constant or an input is the one of `Real` with an
//! f64, as a system in Rust would write it.

use super::syntax::{Function, Pairing, Term, Terms, Wrong};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use zonobench_sets::number::Real;
use zonobench_sets::{Interval, List};

/// The most operations that a tape may have.
pub const LARGEST_TAPE: usize = 65_536;

/// An f64 by its bits, so that operations can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Bits(u64);

impl Bits {
    fn of(x: f64) -> Self {
        Self(x.to_bits())
    }

    fn get(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// A number that is an f64 in every evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// A constant.
    Constant(Bits),
    /// Component i of u.
    Input(u32),
    /// k.
    Step,
    /// k · period + offset.
    Time(Bits),
}

impl Scalar {
    /// The time, `since` seconds after k · period.
    pub(super) fn time(since: f64) -> Self {
        Self::Time(Bits::of(since))
    }
}

/// The result of an operation.
type Register = u32;

/// An operation; registers count the state, then the noise, then the operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Op {
    Load(Scalar),
    Neg(Register),
    Add(Register, Register),
    Sub(Register, Register),
    Mul(Register, Register),
    Div(Register, Register),
    AddScalar(Register, Scalar),
    SubScalar(Register, Scalar),
    MulScalar(Register, Scalar),
    DivScalar(Register, Scalar),
    Recip(Register),
    Powi(Register, i32),
    Powf(Register, Bits),
    Call(Function, Register),
    Pair(Pairing, Register, Register),
}

/// Where an operation stands: the number of its text, and its bytes there.
pub type Origin = (usize, Range<usize>);

/// A value while a tape is being written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// The same f64 in every evaluation.
    Scalar(Scalar),
    /// A register.
    Register(Register),
}

impl Value {
    pub(super) fn constant(x: f64) -> Self {
        Self::Scalar(Scalar::Constant(Bits::of(x)))
    }

    fn as_constant(self) -> Option<f64> {
        match self {
            Self::Scalar(Scalar::Constant(bits)) => Some(bits.get()),
            _ => None,
        }
    }
}

/// A map written as operations.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Tape {
    arguments: usize,
    ops: Vec<Op>,
    origins: Vec<Origin>,
    outputs: Vec<Output>,
    /// Time from step to step, for `Scalar::Time`.
    period: f64,
}

type Output = Value;

/// What an operation is not defined for.
pub struct DomainFault {
    /// Where it stands.
    pub origin: Origin,
    /// What the operand would have to be.
    pub needs: &'static str,
    /// What it is.
    pub operand: Interval,
    /// The arguments that the operand depends on.
    pub arguments: Vec<usize>,
}

impl Tape {
    /// The values at `x` and `noise`, into `out`.
    ///
    /// Outputs in order; `x`, `noise` and `out` have the lengths that the tape was written with.
    pub fn evaluate<S: Real>(&self, k: usize, x: &[S], u: &[f64], noise: &[S], out: &mut [S]) {
        let mut results: List<S> = List::with_capacity(self.arguments + self.ops.len());
        results.extend_from_slice(x);
        results.extend_from_slice(noise);
        for op in &self.ops {
            let result = self.result(*op, k, u, &results);
            results.push(result);
        }
        for (out, output) in out.iter_mut().zip(&self.outputs) {
            *out = match *output {
                Value::Register(r) => results[r as usize],
                Value::Scalar(s) => S::constant(self.scalar(s, k, u)),
            };
        }
    }

    /// Number of operations.
    pub fn len(&self) -> usize {
        self.ops.len()
    }

    /// Whether an input is read.
    pub fn reads_input(&self) -> bool {
        let is_input = |s: &Scalar| matches!(s, Scalar::Input(_));
        let outputs = self
            .outputs
            .iter()
            .any(|o| matches!(o, Value::Scalar(s) if is_input(s)));
        outputs
            || self
                .ops
                .iter()
                .any(|op| op.scalar().as_ref().is_some_and(is_input))
    }

    fn scalar(&self, scalar: Scalar, k: usize, u: &[f64]) -> f64 {
        match scalar {
            Scalar::Constant(bits) => bits.get(),
            Scalar::Input(i) => u[i as usize],
            Scalar::Step => k as f64,
            Scalar::Time(offset) => k as f64 * self.period + offset.get(),
        }
    }

    #[inline]
    fn result<S: Real>(&self, op: Op, k: usize, u: &[f64], results: &[S]) -> S {
        let at = |r: Register| results[r as usize];
        match op {
            Op::Load(s) => S::constant(self.scalar(s, k, u)),
            Op::Neg(a) => -at(a),
            Op::Add(a, b) => at(a) + at(b),
            Op::Sub(a, b) => at(a) - at(b),
            Op::Mul(a, b) => at(a) * at(b),
            Op::Div(a, b) => at(a) / at(b),
            Op::AddScalar(a, s) => at(a) + self.scalar(s, k, u),
            Op::SubScalar(a, s) => at(a) - self.scalar(s, k, u),
            Op::MulScalar(a, s) => at(a) * self.scalar(s, k, u),
            Op::DivScalar(a, s) => at(a) / self.scalar(s, k, u),
            Op::Recip(a) => at(a).recip(),
            Op::Powi(a, n) => at(a).powi(n),
            Op::Powf(a, p) => at(a).powf(p.get()),
            Op::Call(f, a) => call(f, at(a)),
            Op::Pair(f, a, b) => pair(f, at(a), at(b)),
        }
    }

    /// The first operation that is not defined all over the box `x`, among those that depend on `x` and constants alone.
    pub fn domain_fault(&self, x: &[Interval]) -> Option<DomainFault> {
        let mut values = x.to_vec();
        values.resize(self.arguments, Interval::ENTIRE);
        let mut known: Vec<bool> = (0..self.arguments).map(|i| i < x.len()).collect();
        let mut depends: Vec<BTreeSet<usize>> =
            (0..self.arguments).map(|i| BTreeSet::from([i])).collect();
        for (op, origin) in self.ops.iter().zip(&self.origins) {
            let operands = op.operands();
            let is_known = op.is_of_constants() && operands.iter().all(|r| known[*r as usize]);
            if is_known {
                let of: Vec<Interval> = operands.iter().map(|r| values[*r as usize]).collect();
                if let Some((needs, at)) = op.domain(&of) {
                    return Some(DomainFault {
                        origin: origin.clone(),
                        needs,
                        operand: of[at],
                        arguments: depends[operands[at] as usize].iter().copied().collect(),
                    });
                }
                values.push(self.result(*op, 0, &[], &values));
            } else {
                values.push(Interval::ENTIRE);
            }
            known.push(is_known);
            depends.push(
                operands
                    .iter()
                    .flat_map(|r| depends[*r as usize].clone())
                    .collect(),
            );
        }
        None
    }

    /// How the outputs depend on the first `states` arguments, on the inputs, and on the other arguments: 0 not at all, 1
    /// linearly where the others are fixed, 2 otherwise. By structure: x − x depends on x.
    pub fn degrees(&self, states: usize) -> [u8; 3] {
        type Degrees = [u8; 3];
        let of_scalar = |s: Scalar| -> Degrees {
            match s {
                Scalar::Input(_) => [0, 1, 0],
                _ => [0; 3],
            }
        };
        let each = |a: Degrees, b: Degrees, f: fn(u8, u8) -> u8| -> Degrees {
            std::array::from_fn(|i| f(a[i], b[i]).min(2))
        };
        // Of a divisor, and of an argument of a function.
        let bent = |a: Degrees| a.map(|d| if d == 0 { 0 } else { 2 });
        let mut degrees: Vec<Degrees> = (0..self.arguments)
            .map(|i| if i < states { [1, 0, 0] } else { [0, 0, 1] })
            .collect();
        for op in &self.ops {
            let at = |r: Register| degrees[r as usize];
            degrees.push(match *op {
                Op::Load(s) => of_scalar(s),
                Op::Neg(a) => at(a),
                Op::Add(a, b) | Op::Sub(a, b) => each(at(a), at(b), u8::max),
                Op::Mul(a, b) => each(at(a), at(b), |a, b| a + b),
                Op::Div(a, b) => each(at(a), bent(at(b)), |a, b| a + b),
                Op::AddScalar(a, s) | Op::SubScalar(a, s) => each(at(a), of_scalar(s), u8::max),
                Op::MulScalar(a, s) => each(at(a), of_scalar(s), |a, b| a + b),
                Op::DivScalar(a, s) => each(at(a), bent(of_scalar(s)), |a, b| a + b),
                Op::Recip(a) | Op::Powi(a, _) | Op::Powf(a, _) | Op::Call(_, a) => bent(at(a)),
                Op::Pair(_, a, b) => each(bent(at(a)), bent(at(b)), u8::max),
            });
        }
        let outputs = self.outputs.iter().map(|output| match output {
            Value::Register(r) => degrees[*r as usize],
            Value::Scalar(s) => of_scalar(*s),
        });
        outputs.fold([0; 3], |most, d| each(most, d, u8::max))
    }

    /// The outputs as Σ coefficient · argument, by argument (an input counts from `arguments` on), and whether every
    /// coefficient is exact; None where one is not linear, or has a constant part.
    pub fn linear(&self) -> Option<(Vec<Coefficients>, bool)> {
        let mut forms: Vec<Form> = (0..self.arguments).map(Form::of).collect();
        let of_scalar = |s: Scalar| match s {
            Scalar::Constant(bits) => Some(Form::constant(bits.get())),
            Scalar::Input(i) => Some(Form::of(self.arguments + i as usize)),
            Scalar::Step | Scalar::Time(_) => None,
        };
        let constant = |s: Scalar| match s {
            Scalar::Constant(bits) => Some(bits.get()),
            _ => None,
        };
        for op in &self.ops {
            let at = |r: &Register| &forms[*r as usize];
            let form = match op {
                Op::Load(s) => of_scalar(*s)?,
                Op::Neg(a) => at(a).each(|c| -c, |_| true),
                Op::Add(a, b) => at(a).plus(at(b)),
                Op::Sub(a, b) => at(a).plus(&at(b).each(|c| -c, |_| true)),
                Op::AddScalar(a, s) => at(a).plus(&of_scalar(*s)?),
                Op::SubScalar(a, s) => at(a).plus(&of_scalar(*s)?.each(|c| -c, |_| true)),
                Op::MulScalar(a, s) => {
                    let by = constant(*s)?;
                    at(a).each(|c| c * by, |c| exact_product(c, by).is_some())
                }
                Op::DivScalar(a, s) => {
                    let by = constant(*s)?;
                    at(a).each(|c| c / by, |c| exact_quotient(c, by).is_some())
                }
                _ => return None,
            };
            forms.push(form);
        }
        let mut exact = true;
        let outputs = self.outputs.iter().map(|output| {
            let form = match output {
                Value::Register(r) => forms[*r as usize].clone(),
                Value::Scalar(s) => of_scalar(*s)?,
            };
            exact &= form.exact;
            (form.constant == 0.0).then_some(form.coefficients)
        });
        let outputs = outputs.collect::<Option<_>>()?;
        Some((outputs, exact))
    }
}

/// Coefficients by argument.
pub type Coefficients = BTreeMap<usize, f64>;

/// Σ coefficient · argument + constant.
#[derive(Clone, Default)]
struct Form {
    coefficients: Coefficients,
    constant: f64,
    /// Whether no coefficient was rounded.
    exact: bool,
}

impl Form {
    fn of(argument: usize) -> Self {
        Self {
            coefficients: Coefficients::from([(argument, 1.0)]),
            constant: 0.0,
            exact: true,
        }
    }

    fn constant(x: f64) -> Self {
        Self {
            constant: x,
            exact: true,
            ..Self::default()
        }
    }

    fn each(&self, f: impl Fn(f64) -> f64, is_exact: impl Fn(f64) -> bool) -> Self {
        let all = || self.coefficients.values().chain([&self.constant]);
        Self {
            coefficients: self.coefficients.iter().map(|(i, c)| (*i, f(*c))).collect(),
            constant: f(self.constant),
            exact: self.exact && all().all(|c| is_exact(*c)),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        let mut sum = self.clone();
        for (i, c) in &other.coefficients {
            let held = sum.coefficients.get(i).copied().unwrap_or(0.0);
            sum.exact &= exact_sum(held, *c).is_some();
            sum.coefficients.insert(*i, held + c);
        }
        sum.exact &= other.exact && exact_sum(self.constant, other.constant).is_some();
        sum.constant += other.constant;
        sum
    }
}

impl Op {
    /// Its scalar, if it has one.
    fn scalar(&self) -> Option<Scalar> {
        match self {
            Op::Load(s)
            | Op::AddScalar(_, s)
            | Op::SubScalar(_, s)
            | Op::MulScalar(_, s)
            | Op::DivScalar(_, s) => Some(*s),
            _ => None,
        }
    }

    /// Whether it has no input, step or time.
    fn is_of_constants(&self) -> bool {
        self.scalar()
            .is_none_or(|s| matches!(s, Scalar::Constant(_)))
    }

    fn operands(&self) -> Vec<Register> {
        match *self {
            Op::Load(_) => Vec::new(),
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) | Op::Pair(_, a, b) => {
                vec![a, b]
            }
            Op::Neg(a)
            | Op::AddScalar(a, _)
            | Op::SubScalar(a, _)
            | Op::MulScalar(a, _)
            | Op::DivScalar(a, _)
            | Op::Recip(a)
            | Op::Powi(a, _)
            | Op::Powf(a, _)
            | Op::Call(_, a) => vec![a],
        }
    }

    /// What the operation needs and does not have, and of which operand.
    fn domain(&self, operands: &[Interval]) -> Option<(&'static str, usize)> {
        let (needs, at, holds) = match self {
            Op::Div(..) => ("a divisor that is not 0", 1, !operands[1].contains(0.0)),
            Op::Recip(_) => ("a divisor that is not 0", 0, !operands[0].contains(0.0)),
            Op::Powi(_, n) if *n < 0 => ("a base that is not 0", 0, !operands[0].contains(0.0)),
            Op::Powf(_, p) if p.get() < 0.0 => ("a base above 0", 0, operands[0].lo() > 0.0),
            Op::Powf(..) => ("a base of at least 0", 0, operands[0].lo() >= 0.0),
            Op::Pair(Pairing::Pow, ..) => ("a base above 0", 0, operands[0].lo() > 0.0),
            Op::Call(Function::Sqrt, _) => ("at least 0", 0, operands[0].lo() >= 0.0),
            Op::Call(Function::Ln | Function::Log10, _) => {
                ("a number above 0", 0, operands[0].lo() > 0.0)
            }
            Op::Call(Function::Ln1p, _) => ("a number above -1", 0, operands[0].lo() > -1.0),
            Op::Call(Function::Asin | Function::Acos, _) => (
                "a number between -1 and 1",
                0,
                operands[0].is_subset(Interval::UNIT),
            ),
            Op::Call(Function::Tan, _) => (
                "an angle between two poles",
                0,
                operands[0].tan().is_finite(),
            ),
            _ => return None,
        };
        (!holds).then_some((needs, at))
    }
}

fn call<S: Real>(f: Function, a: S) -> S {
    match f {
        Function::Sqrt => a.sqrt(),
        Function::Sqr => a.sqr(),
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Tan => a.tan(),
        Function::Asin => a.asin(),
        Function::Acos => a.acos(),
        Function::Atan => a.atan(),
        Function::Exp => a.exp(),
        Function::ExpM1 => a.exp_m1(),
        Function::Ln => a.ln(),
        Function::Log10 => a.log10(),
        Function::Ln1p => a.ln_1p(),
        Function::Sinh => a.sinh(),
        Function::Cosh => a.cosh(),
        Function::Tanh => a.tanh(),
        Function::Asinh => a.asinh(),
        Function::Abs => a.abs(),
    }
}

fn pair<S: Real>(f: Pairing, a: S, b: S) -> S {
    match f {
        Pairing::Atan2 => a.atan2(b),
        Pairing::Hypot => a.hypot(b),
        Pairing::Min => a.min(b),
        Pairing::Max => a.max(b),
        Pairing::Pow => a.pow(b),
    }
}

/// Writes a tape.
pub struct Writer {
    tape: Tape,
    /// Operations that stand already.
    written: HashMap<Op, Register>,
    /// About what every register is that depends on constants alone.
    fixed: Vec<Option<f64>>,
}

impl Writer {
    /// A tape over `arguments` numbers; the time is k · `period`.
    pub fn new(arguments: usize, period: f64) -> Self {
        Self {
            tape: Tape {
                arguments,
                period,
                ..Tape::default()
            },
            written: HashMap::new(),
            fixed: vec![None; arguments],
        }
    }

    /// The tape with these outputs, without the operations that none of them needs.
    pub fn finish(self, outputs: Vec<Value>) -> Tape {
        let mut tape = self.tape;
        let mut needed = vec![false; tape.arguments + tape.ops.len()];
        for output in &outputs {
            if let Value::Register(r) = output {
                needed[*r as usize] = true;
            }
        }
        for (i, op) in tape.ops.iter().enumerate().rev() {
            if needed[tape.arguments + i] {
                for r in op.operands() {
                    needed[r as usize] = true;
                }
            }
        }
        let mut place: Vec<Register> = (0..tape.arguments as Register).collect();
        let (mut ops, mut origins) = (Vec::new(), Vec::new());
        for (i, op) in tape.ops.iter().enumerate() {
            place.push((tape.arguments + ops.len()) as Register);
            if needed[tape.arguments + i] {
                ops.push(op.moved(&place));
                origins.push(tape.origins[i].clone());
            }
        }
        tape.outputs = outputs
            .into_iter()
            .map(|output| match output {
                Value::Register(r) => Value::Register(place[r as usize]),
                scalar => scalar,
            })
            .collect();
        tape.ops = ops;
        tape.origins = origins;
        tape
    }

    fn push(&mut self, op: Op, origin: &Origin) -> Result<Value, Wrong> {
        self.pushed(op, origin).map(Value::Register)
    }

    fn pushed(&mut self, op: Op, origin: &Origin) -> Result<Register, Wrong> {
        if let Some(&register) = self.written.get(&op) {
            return Ok(register);
        }
        if self.tape.ops.len() == LARGEST_TAPE {
            let expected = format!("at most {LARGEST_TAPE} operations in all");
            return Err(Wrong::new(origin.1.clone(), expected, "more"));
        }
        let register = (self.tape.arguments + self.tape.ops.len()) as Register;
        let fixed = self.fixed_value(op);
        if let Some(x) = fixed {
            Self::number(x, origin)?;
        }
        self.fixed.push(fixed);
        self.tape.ops.push(op);
        self.tape.origins.push(origin.clone());
        self.written.insert(op, register);
        Ok(register)
    }

    fn register(&mut self, value: Value, origin: &Origin) -> Result<Register, Wrong> {
        match value {
            Value::Register(r) => Ok(r),
            Value::Scalar(s) => self.pushed(Op::Load(s), origin),
        }
    }

    /// About what `op` gives, if that depends on constants alone.
    fn fixed_value(&self, op: Op) -> Option<f64> {
        let of_constants = op.is_of_constants()
            && op
                .operands()
                .iter()
                .all(|r| self.fixed[*r as usize].is_some());
        let values: Vec<f64> = op
            .operands()
            .iter()
            .map(|r| self.fixed[*r as usize].unwrap_or(0.0))
            .collect();
        // The operands as registers 0 and 1.
        let own = op.with_operands(&[0, 1]);
        of_constants.then(|| self.tape.result(own, 0, &[], &values))
    }

    /// Refuses a constant that is no finite number.
    fn number(x: f64, origin: &Origin) -> Result<(), Wrong> {
        if x.is_finite() {
            return Ok(());
        }
        let got = if x.is_nan() {
            "none (NaN)"
        } else {
            "an infinite one"
        };
        Err(Wrong::new(origin.1.clone(), "a finite number", got))
    }

    /// About what `value` is, if that depends on constants alone.
    fn constant_of(&self, value: Value) -> Option<f64> {
        match value {
            Value::Scalar(_) => value.as_constant(),
            Value::Register(r) => self.fixed[r as usize],
        }
    }

    pub(super) fn neg(&mut self, a: Value, origin: &Origin) -> Result<Value, Wrong> {
        if let Some(a) = a.as_constant() {
            return Ok(Value::constant(-a));
        }
        let a = self.register(a, origin)?;
        self.push(Op::Neg(a), origin)
    }

    pub(super) fn add(&mut self, a: Value, b: Value, origin: &Origin) -> Result<Value, Wrong> {
        if let (Some(a), Some(b)) = (a.as_constant(), b.as_constant())
            && let Some(sum) = exact_sum(a, b)
        {
            return Ok(Value::constant(sum));
        }
        match (a, b) {
            (Value::Register(a), Value::Register(b)) => self.push(Op::Add(a, b), origin),
            (Value::Register(r), Value::Scalar(s)) | (Value::Scalar(s), Value::Register(r)) => {
                self.push(Op::AddScalar(r, s), origin)
            }
            (a, Value::Scalar(s)) => {
                let a = self.register(a, origin)?;
                self.push(Op::AddScalar(a, s), origin)
            }
        }
    }

    pub(super) fn sub(&mut self, a: Value, b: Value, origin: &Origin) -> Result<Value, Wrong> {
        if let (Some(a), Some(b)) = (a.as_constant(), b.as_constant())
            && let Some(difference) = exact_sum(a, -b)
        {
            return Ok(Value::constant(difference));
        }
        match (a, b) {
            (Value::Register(a), Value::Register(b)) => self.push(Op::Sub(a, b), origin),
            // s − b = −b + s.
            (Value::Scalar(s), Value::Register(b)) => {
                let negative = self.pushed(Op::Neg(b), origin)?;
                self.push(Op::AddScalar(negative, s), origin)
            }
            (a, Value::Scalar(s)) => {
                let a = self.register(a, origin)?;
                self.push(Op::SubScalar(a, s), origin)
            }
        }
    }

    pub(super) fn mul(&mut self, a: Value, b: Value, origin: &Origin) -> Result<Value, Wrong> {
        if let (Some(a), Some(b)) = (a.as_constant(), b.as_constant())
            && let Some(product) = exact_product(a, b)
        {
            return Ok(Value::constant(product));
        }
        match (a, b) {
            (Value::Register(a), Value::Register(b)) => self.push(Op::Mul(a, b), origin),
            (Value::Register(r), Value::Scalar(s)) | (Value::Scalar(s), Value::Register(r)) => {
                self.push(Op::MulScalar(r, s), origin)
            }
            (a, Value::Scalar(s)) => {
                let a = self.register(a, origin)?;
                self.push(Op::MulScalar(a, s), origin)
            }
        }
    }

    fn div(&mut self, a: Value, b: Value, origin: &Origin) -> Result<Value, Wrong> {
        if self.constant_of(b) == Some(0.0) {
            return Err(Wrong::new(origin.1.clone(), "a divisor that is not 0", "0"));
        }
        if let (Some(a), Some(b)) = (a.as_constant(), b.as_constant())
            && let Some(quotient) = exact_quotient(a, b)
        {
            return Ok(Value::constant(quotient));
        }
        match (a, b) {
            (a, Value::Scalar(s)) => {
                let a = self.register(a, origin)?;
                self.push(Op::DivScalar(a, s), origin)
            }
            (a, Value::Register(b)) if a.as_constant() == Some(1.0) => {
                self.push(Op::Recip(b), origin)
            }
            (a, Value::Register(b)) => {
                let a = self.register(a, origin)?;
                self.push(Op::Div(a, b), origin)
            }
        }
    }

    fn power(&mut self, a: Value, b: Value, origin: &Origin) -> Result<Value, Wrong> {
        let Some(exponent) = b.as_constant() else {
            let (a, b) = (self.register(a, origin)?, self.register(b, origin)?);
            return self.push(Op::Pair(Pairing::Pow, a, b), origin);
        };
        let whole = exponent as i32;
        if exponent == 2.0
            && let Some(a) = a.as_constant()
            && let Some(square) = exact_product(a, a)
        {
            return Ok(Value::constant(square));
        }
        let a = self.register(a, origin)?;
        match whole {
            _ if f64::from(whole) != exponent => self.push(Op::Powf(a, Bits::of(exponent)), origin),
            1 => Ok(Value::Register(a)),
            -1 => self.push(Op::Recip(a), origin),
            2 => self.push(Op::Call(Function::Sqr, a), origin),
            n => self.push(Op::Powi(a, n), origin),
        }
    }

    /// Writes the terms of text number `text`; `of_name` gives the value of a name.
    pub fn write(
        &mut self,
        text: usize,
        terms: &Terms,
        mut of_name: impl FnMut(&str, &Range<usize>) -> Result<Value, Wrong>,
    ) -> Result<Value, Wrong> {
        let mut values: Vec<Value> = Vec::with_capacity(terms.list.len());
        for (term, range) in &terms.list {
            let origin = (text, range.clone());
            let v = |i: &usize| values[*i];
            let value = match term {
                Term::Number(x) => Value::constant(*x),
                Term::Name(name) => of_name(name, range)?,
                Term::Neg(a) => self.neg(v(a), &origin)?,
                Term::Add(a, b) => self.add(v(a), v(b), &origin)?,
                Term::Sub(a, b) => self.sub(v(a), v(b), &origin)?,
                Term::Mul(a, b) => self.mul(v(a), v(b), &origin)?,
                Term::Div(a, b) => self.div(v(a), v(b), &origin)?,
                Term::Power(a, b) => self.power(v(a), v(b), &origin)?,
                Term::Call(f, a) => {
                    let a = self.register(v(a), &origin)?;
                    self.push(Op::Call(*f, a), &origin)?
                }
                Term::Pair(Pairing::Pow, a, b) => self.power(v(a), v(b), &origin)?,
                Term::Pair(f, a, b) => {
                    let (a, b) = (self.register(v(a), &origin)?, self.register(v(b), &origin)?);
                    self.push(Op::Pair(*f, a, b), &origin)?
                }
            };
            values.push(value);
        }
        Ok(*values.last().expect("a text that was read has a term"))
    }
}

/// a + b, if it is an f64.
fn exact_sum(a: f64, b: f64) -> Option<f64> {
    let s = a + b;
    let (large, small) = if a.abs() < b.abs() { (b, a) } else { (a, b) };
    (s.is_finite() && small - (s - large) == 0.0).then_some(s)
}

/// a · b, if it is a normal f64 or 0.
fn exact_product(a: f64, b: f64) -> Option<f64> {
    let p = a * b;
    let plain = a == 0.0 || b == 0.0 || (p.is_normal() && p.abs() > 1e-250);
    (plain && libm::fma(a, b, -p) == 0.0).then_some(p)
}

/// a / b, if it is a normal f64 or 0.
fn exact_quotient(a: f64, b: f64) -> Option<f64> {
    let q = a / b;
    let plain = a == 0.0 || (q.is_normal() && q.abs() > 1e-250 && a.abs() > 1e-250);
    (plain && libm::fma(q, b, -a) == 0.0).then_some(q)
}

impl Op {
    /// The operation with other operands, in order.
    fn with_operands(self, others: &[Register]) -> Self {
        let mut place = vec![
            0;
            self.operands()
                .iter()
                .map(|r| *r as usize + 1)
                .max()
                .unwrap_or(0)
        ];
        for (r, other) in self.operands().iter().zip(others) {
            place[*r as usize] = *other;
        }
        self.moved(&place)
    }

    /// The operation with every register moved to its `place`.
    fn moved(self, place: &[Register]) -> Self {
        let at = |r: Register| place[r as usize];
        match self {
            Op::Load(s) => Op::Load(s),
            Op::Neg(a) => Op::Neg(at(a)),
            Op::Add(a, b) => Op::Add(at(a), at(b)),
            Op::Sub(a, b) => Op::Sub(at(a), at(b)),
            Op::Mul(a, b) => Op::Mul(at(a), at(b)),
            Op::Div(a, b) => Op::Div(at(a), at(b)),
            Op::AddScalar(a, s) => Op::AddScalar(at(a), s),
            Op::SubScalar(a, s) => Op::SubScalar(at(a), s),
            Op::MulScalar(a, s) => Op::MulScalar(at(a), s),
            Op::DivScalar(a, s) => Op::DivScalar(at(a), s),
            Op::Recip(a) => Op::Recip(at(a)),
            Op::Powi(a, n) => Op::Powi(at(a), n),
            Op::Powf(a, p) => Op::Powf(at(a), p),
            Op::Call(f, a) => Op::Call(f, at(a)),
            Op::Pair(f, a, b) => Op::Pair(f, at(a), at(b)),
        }
    }
}
