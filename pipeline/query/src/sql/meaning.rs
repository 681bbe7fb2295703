//! What statements mean where SQL leaves it open, or DataFusion has it otherwise: as in DuckDB.
//!
//! `/` of integers is a fraction and `//` their whole quotient; a sum or product of integers that leaves 64
//! bits is an error and not another number; a float becomes the nearest integer; the median of integers may
//! lie between two; 0 and −0 are equal.

use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{Array, ArrayRef, Int64Array, PrimitiveArray};
use datafusion::arrow::compute::kernels::numeric;
use datafusion::arrow::compute::{CastOptions, cast as cast_array};
use datafusion::arrow::datatypes::{DataType, Float64Type};
use datafusion::common::{DFSchema, DataFusionError, Result, ScalarValue};
use datafusion::logical_expr::expr::{AggregateFunction, WindowFunction, WindowFunctionParams};
use datafusion::logical_expr::planner::{
    ExprPlanner, PlannerResult, RawAggregateExpr, RawBinaryExpr, RawWindowExpr,
};
use datafusion::logical_expr::{
    BinaryExpr, ColumnarValue, Expr, ExprSchemable, Operator, ScalarFunctionArgs, ScalarUDF,
    ScalarUDFImpl, Signature, Volatility, cast,
};
use datafusion::physical_expr_common::datum::apply;
use datafusion::sql::sqlparser::ast::{self, BinaryOperator};
use std::sync::{Arc, LazyLock};

/// Plans operators and functions with the meaning that this module speaks of.
#[derive(Debug)]
pub(crate) struct Meaning;

impl ExprPlanner for Meaning {
    fn plan_binary_op(
        &self,
        expr: RawBinaryExpr,
        schema: &DFSchema,
    ) -> Result<PlannerResult<RawBinaryExpr>> {
        let (Ok(left), Ok(right)) = (expr.left.get_type(schema), expr.right.get_type(schema))
        else {
            return Ok(PlannerResult::Original(expr));
        };
        let integers = left.is_integer() && right.is_integer();
        let comparison = matches!(
            expr.op,
            BinaryOperator::Eq
                | BinaryOperator::NotEq
                | BinaryOperator::Lt
                | BinaryOperator::LtEq
                | BinaryOperator::Gt
                | BinaryOperator::GtEq
        );
        let RawBinaryExpr { op, left, right } = expr;
        let binary = |left, op, right| {
            Expr::BinaryExpr(BinaryExpr::new(Box::new(left), op, Box::new(right)))
        };
        let whole = |left, right| vec![cast(left, DataType::Int64), cast(right, DataType::Int64)];
        Ok(PlannerResult::Planned(match op {
            BinaryOperator::Divide if integers => binary(
                cast(left, DataType::Float64),
                Operator::Divide,
                cast(right, DataType::Float64),
            ),
            BinaryOperator::DuckIntegerDivide if integers => QUOTIENT.call(whole(left, right)),
            BinaryOperator::Modulo if integers => REMAINDER.call(whole(left, right)),
            BinaryOperator::Plus if integers => SUM.call(whole(left, right)),
            BinaryOperator::Minus if integers => DIFFERENCE.call(whole(left, right)),
            BinaryOperator::Multiply if integers => PRODUCT.call(whole(left, right)),
            op if comparison
                && (may_be_minus_zero(&left, schema) || may_be_minus_zero(&right, schema)) =>
            {
                return Ok(PlannerResult::Original(RawBinaryExpr {
                    op,
                    left: without_minus_zero(left, schema),
                    right: without_minus_zero(right, schema),
                }));
            }
            op => return Ok(PlannerResult::Original(RawBinaryExpr { op, left, right })),
        }))
    }

    fn plan_aggregate(
        &self,
        mut expr: RawAggregateExpr,
    ) -> Result<PlannerResult<RawAggregateExpr>> {
        match expr.func.name() {
            "median" => expr.args = as_floats(expr.args),
            "sum" => {
                let sum = AggregateFunction::new_udf(
                    expr.func,
                    widened(expr.args),
                    expr.distinct,
                    expr.filter,
                    expr.order_by,
                    expr.null_treatment,
                );
                let sum = Expr::AggregateFunction(sum);
                return Ok(PlannerResult::Planned(NARROW.call(vec![sum])));
            }
            _ => {}
        }
        Ok(PlannerResult::Original(expr))
    }

    fn plan_window(&self, mut expr: RawWindowExpr) -> Result<PlannerResult<RawWindowExpr>> {
        match expr.func_def.name() {
            "median" => expr.args = as_floats(expr.args),
            "sum" => {
                let sum = WindowFunction {
                    fun: expr.func_def,
                    params: WindowFunctionParams {
                        args: widened(expr.args),
                        partition_by: expr.partition_by,
                        order_by: expr.order_by,
                        window_frame: expr.window_frame,
                        filter: expr.filter,
                        null_treatment: expr.null_treatment,
                        distinct: expr.distinct,
                    },
                };
                let sum = Expr::WindowFunction(Box::new(sum));
                return Ok(PlannerResult::Planned(NARROW.call(vec![sum])));
            }
            _ => {}
        }
        Ok(PlannerResult::Original(expr))
    }
}

fn as_floats(args: Vec<Expr>) -> Vec<Expr> {
    args.into_iter()
        .map(|x| cast(x, DataType::Float64))
        .collect()
}

fn widened(args: Vec<Expr>) -> Vec<Expr> {
    args.into_iter().map(|x| WIDE.call(vec![x])).collect()
}

/// A float that is computed: those of tables and statements are no −0.
fn may_be_minus_zero(expr: &Expr, schema: &DFSchema) -> bool {
    !matches!(
        expr,
        Expr::Column(_) | Expr::OuterReferenceColumn(..) | Expr::Literal(..)
    ) && expr.get_type(schema).is_ok_and(|t| t.is_floating())
}

fn without_minus_zero(expr: Expr, schema: &DFSchema) -> Expr {
    if may_be_minus_zero(&expr, schema) {
        POSITIVE_ZERO.call(vec![expr])
    } else if let Expr::Literal(ScalarValue::Float64(Some(x)), metadata) = expr {
        Expr::Literal(ScalarValue::Float64(Some(x + 0.0)), metadata)
    } else {
        expr
    }
}

static SUM: LazyLock<ScalarUDF> = LazyLock::new(|| Checked::udf("sum of integers", "+"));
static DIFFERENCE: LazyLock<ScalarUDF> = LazyLock::new(|| Checked::udf("difference", "-"));
static PRODUCT: LazyLock<ScalarUDF> = LazyLock::new(|| Checked::udf("product of integers", "*"));
static QUOTIENT: LazyLock<ScalarUDF> = LazyLock::new(|| Checked::udf("whole quotient", "//"));
static REMAINDER: LazyLock<ScalarUDF> = LazyLock::new(|| Checked::udf("remainder", "%"));
static POSITIVE_ZERO: LazyLock<ScalarUDF> =
    LazyLock::new(|| OfFloats::udf("positive_zero", Rounding::None));
static NEAREST: LazyLock<ScalarUDF> =
    LazyLock::new(|| OfFloats::udf(NEAREST_NAME, Rounding::TiesToEven));
static NEAREST_OF_DECIMALS: LazyLock<ScalarUDF> =
    LazyLock::new(|| OfFloats::udf(NEAREST_OF_DECIMALS_NAME, Rounding::TiesAway));

static WIDE: LazyLock<ScalarUDF> = LazyLock::new(|| Width::udf("wide", true));
static NARROW: LazyLock<ScalarUDF> = LazyLock::new(|| Width::udf("narrow", false));

/// Of two that are as near, the even one.
const NEAREST_NAME: &str = "nearest_integer";
/// Of two that are as near, the one away from zero: for `2.5` as it is written, which is a decimal.
const NEAREST_OF_DECIMALS_NAME: &str = "nearest_integer_of_decimal";

/// The functions that statements are rewritten with.
pub(crate) fn functions() -> Vec<Arc<ScalarUDF>> {
    vec![
        Arc::new(NEAREST.clone()),
        Arc::new(NEAREST_OF_DECIMALS.clone()),
        Arc::new(ScalarUDF::from(Length {
            signature: Signature::any(1, Volatility::Immutable),
        })),
        Arc::new(
            datafusion::functions::math::signum()
                .as_ref()
                .clone()
                .with_aliases(["sign"]),
        ),
    ]
}

/// Integer arithmetic in 64 bits that fails where it would wrap.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Checked {
    name: &'static str,
    sign: &'static str,
    signature: Signature,
}

impl Checked {
    fn udf(name: &'static str, sign: &'static str) -> ScalarUDF {
        ScalarUDF::from(Self {
            name,
            sign,
            signature: Signature::exact(
                vec![DataType::Int64, DataType::Int64],
                Volatility::Immutable,
            ),
        })
    }
}

impl ScalarUDFImpl for Checked {
    fn name(&self) -> &str {
        self.name
    }

    fn display_name(&self, args: &[Expr]) -> Result<String> {
        Ok(format!("{} {} {}", args[0], self.sign, args[1]))
    }

    fn schema_name(&self, args: &[Expr]) -> Result<String> {
        let name = |i: usize| args[i].schema_name();
        Ok(format!("{} {} {}", name(0), self.sign, name(1)))
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Int64)
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let (left, right) = (&args.args[0], &args.args[1]);
        match self.sign {
            "+" => apply(left, right, numeric::add),
            "-" => apply(left, right, numeric::sub),
            "*" => apply(left, right, numeric::mul),
            "//" => apply(left, right, numeric::div),
            _ => apply(left, right, numeric::rem),
        }
    }
}

/// How many characters a text has, or entries a list.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Length {
    signature: Signature,
}

impl ScalarUDFImpl for Length {
    fn name(&self) -> &str {
        "length"
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Int64)
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let values = args.args[0].to_array(args.number_rows)?;
        let lengths: Int64Array = match values.data_type() {
            DataType::List(_) => {
                let lists = values.as_list::<i32>();
                lists
                    .iter()
                    .map(|list| list.map(|l| l.len() as i64))
                    .collect()
            }
            DataType::Utf8
            | DataType::LargeUtf8
            | DataType::Utf8View
            | DataType::Dictionary(..)
            | DataType::Null => {
                let texts = cast_array(&values, &DataType::Utf8)?;
                let texts = texts.as_string::<i32>();
                texts
                    .iter()
                    .map(|t| t.map(|t| t.chars().count() as i64))
                    .collect()
            }
            other => {
                let message = format!("LENGTH takes a text or a list, got {other}");
                return Err(DataFusionError::Plan(message));
            }
        };
        Ok(ColumnarValue::Array(Arc::new(lengths)))
    }
}

/// Integers of 128 bits, in which sums cannot wrap.
const LONG: DataType = DataType::Decimal128(38, 0);

/// From integers to 128 bits, or back if they fit into 64; all else stays as it is.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Width {
    name: &'static str,
    wider: bool,
    signature: Signature,
}

impl Width {
    fn udf(name: &'static str, wider: bool) -> ScalarUDF {
        ScalarUDF::from(Self {
            name,
            wider,
            signature: Signature::any(1, Volatility::Immutable),
        })
    }
}

impl ScalarUDFImpl for Width {
    fn name(&self) -> &str {
        self.name
    }

    fn display_name(&self, args: &[Expr]) -> Result<String> {
        Ok(args[0].to_string())
    }

    fn schema_name(&self, args: &[Expr]) -> Result<String> {
        Ok(args[0].schema_name().to_string())
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, args: &[DataType]) -> Result<DataType> {
        Ok(match (&args[0], self.wider) {
            (t, true) if t.is_integer() => LONG,
            (t, false) if *t == LONG => DataType::Int64,
            (t, _) => t.clone(),
        })
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let to = args.return_type();
        let checked = CastOptions {
            safe: false,
            ..CastOptions::default()
        };
        match &args.args[0] {
            value if value.data_type() == *to => Ok(value.clone()),
            value => value.cast_to(to, Some(&checked)),
        }
    }
}

/// What a function of floats does to a number.
#[derive(Debug, PartialEq, Eq, Hash)]
enum Rounding {
    /// Nothing but −0 to 0
    None,
    TiesToEven,
    TiesAway,
}

impl Rounding {
    fn of(&self, x: f64) -> f64 {
        match self {
            Self::None => x + 0.0,
            Self::TiesToEven => x.round_ties_even(),
            Self::TiesAway => x.round(),
        }
    }
}

/// A function of floats that leaves all else as it is.
#[derive(Debug, PartialEq, Eq, Hash)]
struct OfFloats {
    name: &'static str,
    signature: Signature,
    rounding: Rounding,
}

impl OfFloats {
    fn udf(name: &'static str, rounding: Rounding) -> ScalarUDF {
        ScalarUDF::from(Self {
            name,
            signature: Signature::any(1, Volatility::Immutable),
            rounding,
        })
    }
}

impl ScalarUDFImpl for OfFloats {
    fn name(&self) -> &str {
        self.name
    }

    fn display_name(&self, args: &[Expr]) -> Result<String> {
        Ok(args[0].to_string())
    }

    fn schema_name(&self, args: &[Expr]) -> Result<String> {
        Ok(args[0].schema_name().to_string())
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, args: &[DataType]) -> Result<DataType> {
        Ok(args[0].clone())
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        Ok(match &args.args[0] {
            ColumnarValue::Scalar(ScalarValue::Float64(Some(x))) => {
                ColumnarValue::Scalar(ScalarValue::Float64(Some(self.rounding.of(*x))))
            }
            ColumnarValue::Array(array) if *array.data_type() == DataType::Float64 => {
                let floats = array.as_primitive::<Float64Type>();
                let result: PrimitiveArray<Float64Type> = floats.unary(|x| self.rounding.of(x));
                ColumnarValue::Array(Arc::new(result) as ArrayRef)
            }
            other => other.clone(),
        })
    }
}

/// `CAST(x AS BIGINT)` of a float: the nearest integer, of two the even one.
pub(crate) fn rounded_cast(expr: &mut ast::Expr) {
    use ast::DataType as T;
    if let ast::Expr::Cast {
        expr: inner,
        data_type:
            T::TinyInt(_)
            | T::SmallInt(_)
            | T::Int(_)
            | T::Integer(_)
            | T::BigInt(_)
            | T::Int8(_)
            | T::Int2(_)
            | T::Int4(_)
            | T::Int64
            | T::Int32
            | T::Int16,
        ..
    } = expr
    {
        let argument = std::mem::replace(inner.as_mut(), ast::Expr::Value(ast::Value::Null.into()));
        let name = if is_decimal(&argument) {
            NEAREST_OF_DECIMALS_NAME
        } else {
            NEAREST_NAME
        };
        *inner.as_mut() = call(name, argument);
    }
}

/// True for a number that is written with a point and without an exponent.
fn is_decimal(expr: &ast::Expr) -> bool {
    match expr {
        ast::Expr::UnaryOp { expr, .. } | ast::Expr::Nested(expr) => is_decimal(expr),
        ast::Expr::Value(value) => match &value.value {
            ast::Value::Number(digits, _) => digits.contains('.') && !digits.contains(['e', 'E']),
            _ => false,
        },
        _ => false,
    }
}

fn call(name: &str, argument: ast::Expr) -> ast::Expr {
    let list = ast::FunctionArgumentList {
        duplicate_treatment: None,
        args: vec![ast::FunctionArg::Unnamed(ast::FunctionArgExpr::Expr(
            argument,
        ))],
        clauses: Vec::new(),
    };
    ast::Expr::Function(ast::Function {
        name: ast::ObjectName::from(vec![ast::Ident::new(name)]),
        uses_odbc_syntax: false,
        parameters: ast::FunctionArguments::None,
        args: ast::FunctionArguments::List(list),
        filter: None,
        null_treatment: None,
        over: None,
        within_group: Vec::new(),
    })
}

/// The expression as it was written, without what was put into it here.
pub(crate) fn as_written(expr: &ast::Expr) -> String {
    let mut expr = expr.clone();
    let _: std::ops::ControlFlow<()> = ast::visit_expressions_mut(&mut expr, |e| {
        if let ast::Expr::Cast { expr: inner, .. } = e
            && let ast::Expr::Function(function) = inner.as_ref()
            && [NEAREST_NAME, NEAREST_OF_DECIMALS_NAME]
                .contains(&function.name.to_string().as_str())
            && let ast::FunctionArguments::List(list) = &function.args
            && let Some(ast::FunctionArg::Unnamed(ast::FunctionArgExpr::Expr(argument))) =
                list.args.first()
        {
            let argument = argument.clone();
            **inner = argument;
        }
        std::ops::ControlFlow::Continue(())
    });
    expr.to_string()
}
