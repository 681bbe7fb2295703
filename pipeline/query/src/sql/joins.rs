//! Joins as DuckDB has them, where DataFusion does not know them or takes them for others.
//!
//! SEMI and ANTI are of the left side. A column that USING names is one column of both sides: that of the right side
//! in a RIGHT JOIN, of whichever has it in a FULL JOIN. DataFusion takes the left one by its name, and for `*` that of
//! the table whose name comes first.

use crate::sql::fault::Fault;
use datafusion::sql::sqlparser::ast::{
    BinaryOperator, ExcludeSelectItem, Expr, Function, FunctionArg, FunctionArgExpr,
    FunctionArgumentList, FunctionArguments, Ident, JoinConstraint, JoinOperator, ObjectName,
    OrderBy, Query, Select, SelectItem, SelectItemQualifiedWildcardKind, SetExpr, Statement,
    TableFactor, TableWithJoins, VisitMut, VisitorMut, WildcardAdditionalOptions,
};
use std::ops::ControlFlow;

/// Writes the joins of a statement so that DataFusion means the same.
pub(crate) fn rewrite(statement: &mut Statement) -> Result<(), Fault> {
    match statement.visit(&mut Joins) {
        ControlFlow::Break(fault) => Err(fault),
        ControlFlow::Continue(()) => Ok(()),
    }
}

struct Joins;

impl VisitorMut for Joins {
    type Break = Fault;

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<Fault> {
        match of_body(&mut query.body, query.order_by.as_mut()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(fault) => ControlFlow::Break(fault),
        }
    }
}

fn of_body(body: &mut SetExpr, order_by: Option<&mut OrderBy>) -> Result<(), Fault> {
    match body {
        SetExpr::Select(select) => of_select(select, order_by),
        SetExpr::SetOperation { left, right, .. } => {
            of_body(left, None)?;
            of_body(right, None)
        }
        _ => Ok(()),
    }
}

fn of_select(select: &mut Select, order_by: Option<&mut OrderBy>) -> Result<(), Fault> {
    let all = select
        .projection
        .iter()
        .any(|item| matches!(item, SelectItem::Wildcard(_)));
    let mut merged = Merged::default();
    for table in &mut select.from {
        of_left_side(table);
        merged.add(table, all)?;
    }
    if merged.columns.is_empty() {
        return Ok(());
    }
    if all {
        let items = std::mem::take(&mut select.projection);
        for item in items {
            match item {
                SelectItem::Wildcard(options)
                    if options == WildcardAdditionalOptions::default() =>
                {
                    select.projection.extend(merged.all_columns()?);
                }
                SelectItem::Wildcard(_) => {
                    return refused("* with EXCLUDE and the like over USING");
                }
                item => select.projection.push(item),
            }
        }
    }
    let given: Vec<String> = select
        .projection
        .iter()
        .filter_map(|item| match item {
            SelectItem::ExprWithAlias { alias, .. } => Some(normal(alias)),
            SelectItem::UnnamedExpr(Expr::Identifier(name)) => Some(normal(name)),
            _ => None,
        })
        .collect();
    for item in &mut select.projection {
        if let SelectItem::UnnamedExpr(Expr::Identifier(name)) = item
            && let Some(column) = merged.column(name)
        {
            *item = SelectItem::ExprWithAlias {
                expr: column.clone(),
                alias: name.clone(),
            };
        }
    }
    let mut named = Named {
        merged: &merged,
        inside: 0,
        but: &[],
    };
    let _: ControlFlow<()> = select.projection.visit(&mut named);
    let _: ControlFlow<()> = select.selection.visit(&mut named);
    let _: ControlFlow<()> = select.group_by.visit(&mut named);
    let _: ControlFlow<()> = select.having.visit(&mut named);
    let _: ControlFlow<()> = select.qualify.visit(&mut named);
    let _: ControlFlow<()> = select.named_window.visit(&mut named);
    let _: ControlFlow<()> = select.distinct.visit(&mut named);
    if let Some(order_by) = order_by {
        // There a column of the answer comes before one of the tables.
        named.but = &given;
        let _: ControlFlow<()> = order_by.visit(&mut named);
    }
    Ok(())
}

/// SEMI and ANTI, within brackets too.
fn of_left_side(table: &mut TableWithJoins) {
    if let TableFactor::NestedJoin {
        table_with_joins, ..
    } = &mut table.relation
    {
        of_left_side(table_with_joins);
    }
    for join in &mut table.joins {
        if let TableFactor::NestedJoin {
            table_with_joins, ..
        } = &mut join.relation
        {
            of_left_side(table_with_joins);
        }
        let none = JoinOperator::CrossJoin(JoinConstraint::None);
        join.join_operator = match std::mem::replace(&mut join.join_operator, none) {
            JoinOperator::Semi(on) => JoinOperator::LeftSemi(on),
            JoinOperator::Anti(on) => JoinOperator::LeftAnti(on),
            other => other,
        };
    }
}

/// Which side has all that a joined row has.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Both,
    Left,
    Right,
    Either,
}

fn constraint(join: &mut JoinOperator) -> Option<(Side, &mut JoinConstraint)> {
    use JoinOperator as J;
    Some(match join {
        J::Join(on) | J::Inner(on) => (Side::Both, on),
        J::Left(on) | J::LeftOuter(on) => (Side::Left, on),
        J::LeftSemi(on) | J::LeftAnti(on) => (Side::Left, on),
        J::Right(on) | J::RightOuter(on) | J::RightSemi(on) | J::RightAnti(on) => (Side::Right, on),
        J::FullOuter(on) => (Side::Either, on),
        _ => return None,
    })
}

/// The columns that are one of both sides, as DataFusion is to read them.
#[derive(Default)]
struct Merged {
    columns: Vec<(String, Expr)>,
    /// The tables of the statement, and which of their columns are shown with another's.
    tables: Vec<(Option<Ident>, Vec<String>)>,
}

impl Merged {
    fn column(&self, name: &Ident) -> Option<&Expr> {
        let name = normal(name);
        let found = self.columns.iter().find(|(column, _)| *column == name);
        found.map(|(_, column)| column)
    }

    /// Goes through the joins of a table; `all` if the statement asks for all columns.
    fn add(&mut self, table: &mut TableWithJoins, all: bool) -> Result<(), Fault> {
        let mut before = vec![called(&table.relation)];
        self.tables.push((called(&table.relation), Vec::new()));
        for join in &mut table.joins {
            let right = called(&join.relation);
            let mut shown = Vec::new();
            let half = matches!(
                join.join_operator,
                JoinOperator::LeftSemi(_) | JoinOperator::LeftAnti(_)
            );
            if let Some((side, on)) = constraint(&mut join.join_operator) {
                match on {
                    JoinConstraint::Natural if side != Side::Both => {
                        return refused("NATURAL in a LEFT, RIGHT or FULL JOIN");
                    }
                    JoinConstraint::Natural if all => return refused("* over NATURAL JOIN"),
                    JoinConstraint::Using(_)
                        if matches!(side, Side::Right | Side::Either) && all =>
                    {
                        return refused("* over USING in a RIGHT or FULL JOIN");
                    }
                    JoinConstraint::Using(names) => {
                        let Some(equal) = self.both_sides(&before, right.as_ref(), names, side)
                        else {
                            return refused(
                                "USING with a table that has no name, or a column of several",
                            );
                        };
                        shown.extend(
                            names
                                .iter()
                                .filter_map(|n| n.0.last()?.as_ident())
                                .map(normal),
                        );
                        *on = JoinConstraint::On(equal);
                    }
                    _ => {}
                }
            }
            if !half {
                before.push(right.clone());
                self.tables.push((right, shown));
            }
        }
        Ok(())
    }

    /// What `*` stands for: the columns of each table, but those that another shows.
    fn all_columns(&self) -> Result<Vec<SelectItem>, Fault> {
        let columns = |(table, shown): &(Option<Ident>, Vec<String>)| {
            let name = ObjectName::from(vec![table.clone()?]);
            let but = shown
                .iter()
                .map(|c| ObjectName::from(vec![Ident::with_quote('"', c)]));
            let options = WildcardAdditionalOptions {
                opt_exclude: (!shown.is_empty())
                    .then(|| ExcludeSelectItem::Multiple(but.collect())),
                ..WildcardAdditionalOptions::default()
            };
            let kind = SelectItemQualifiedWildcardKind::ObjectName(name);
            Some(SelectItem::QualifiedWildcard(kind, options))
        };
        match self.tables.iter().map(columns).collect::<Option<Vec<_>>>() {
            Some(items) => Ok(items),
            None => refused("* over USING with a table that has no name"),
        }
    }

    /// Notes the columns that USING names, and gives what it says of them.
    fn both_sides(
        &mut self,
        before: &[Option<Ident>],
        right: Option<&Ident>,
        names: &[ObjectName],
        side: Side,
    ) -> Option<Expr> {
        let mut equal: Option<Expr> = None;
        for name in names {
            let [part] = name.0.as_slice() else {
                return None;
            };
            let name = part.as_ident()?;
            let left = match (self.column(name), before) {
                (Some(column), _) => column.clone(),
                (None, [Some(only)]) => Expr::CompoundIdentifier(vec![only.clone(), name.clone()]),
                (None, _) => return None,
            };
            let right = Expr::CompoundIdentifier(vec![right?.clone(), name.clone()]);
            let same = binary(left.clone(), BinaryOperator::Eq, right.clone());
            equal = Some(match equal {
                None => same,
                Some(equal) => binary(equal, BinaryOperator::And, same),
            });
            let both = match side {
                Side::Both | Side::Left => left,
                Side::Right => right,
                Side::Either => coalesce(left, right),
            };
            let name = normal(name);
            self.columns.retain(|(column, _)| *column != name);
            self.columns.push((name, both));
        }
        equal
    }
}

fn refused<T>(what: &str) -> Result<T, Fault> {
    Err(Fault::statement(format!(
        "{what} is refused: write ON, and name the columns"
    )))
}

fn binary(left: Expr, op: BinaryOperator, right: Expr) -> Expr {
    Expr::BinaryOp {
        left: Box::new(left),
        op,
        right: Box::new(right),
    }
}

fn coalesce(left: Expr, right: Expr) -> Expr {
    let argument = |e| FunctionArg::Unnamed(FunctionArgExpr::Expr(e));
    Expr::Function(Function {
        name: ObjectName::from(vec![Ident::new("coalesce")]),
        uses_odbc_syntax: false,
        parameters: FunctionArguments::None,
        args: FunctionArguments::List(FunctionArgumentList {
            duplicate_treatment: None,
            args: vec![argument(left), argument(right)],
            clauses: Vec::new(),
        }),
        filter: None,
        null_treatment: None,
        over: None,
        within_group: Vec::new(),
    })
}

/// The name that a table goes by in its statement.
fn called(table: &TableFactor) -> Option<Ident> {
    match table {
        TableFactor::Table { name, alias, .. } => match alias {
            Some(alias) => Some(alias.name.clone()),
            None => name.0.last().and_then(|part| part.as_ident()).cloned(),
        },
        TableFactor::Derived { alias, .. }
        | TableFactor::Function { alias, .. }
        | TableFactor::UNNEST { alias, .. } => alias.as_ref().map(|alias| alias.name.clone()),
        _ => None,
    }
}

fn normal(name: &Ident) -> String {
    if name.quote_style.is_some() {
        name.value.clone()
    } else {
        name.value.to_lowercase()
    }
}

/// Puts the columns of both sides in the place of their names, but not in queries inside, whose names are their own.
struct Named<'a> {
    merged: &'a Merged,
    inside: usize,
    but: &'a [String],
}

impl VisitorMut for Named<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        self.inside += 1;
        ControlFlow::Continue(())
    }

    fn post_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        self.inside -= 1;
        ControlFlow::Continue(())
    }

    fn pre_visit_expr(&mut self, expr: &mut Expr) -> ControlFlow<()> {
        if self.inside == 0
            && let Expr::Identifier(name) = expr
            && !self.but.contains(&normal(name))
            && let Some(column) = self.merged.column(name)
        {
            *expr = column.clone();
        }
        ControlFlow::Continue(())
    }
}
