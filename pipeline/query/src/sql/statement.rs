//! From text to one statement that only reads.

use crate::sql::dialect::Duck;
use crate::sql::fault::Fault;
use crate::sql::{joins, meaning};
use datafusion::sql::parser::{DFParserBuilder, Statement};
use datafusion::sql::sqlparser::ast::{
    self, Expr, Ident, Query, SelectItem, SetExpr, visit_expressions_mut,
};
use std::ops::ControlFlow;

/// Nested brackets in a statement.
const DEPTH: usize = 200;

/// The statement, if it is one and only reads; its columns are called as they are written.
pub(crate) fn parse(sql: &str) -> Result<Statement, Fault> {
    let mut statements = DFParserBuilder::new(sql)
        .with_dialect(&Duck)
        .with_recursion_limit(DEPTH)
        .build()
        .and_then(|mut parser| parser.parse_statements())
        .map_err(Fault::of)?;
    let Some(mut statement) = statements.pop_front() else {
        return Err(Fault::statement(
            "expected a statement, such as SELECT * FROM scores; got nothing",
        ));
    };
    if !statements.is_empty() {
        return Err(Fault::statement(format!(
            "expected one statement, got {}",
            statements.len() + 1
        )));
    }
    only_reads(&statement)?;
    rewrite(&mut statement)?;
    Ok(statement)
}

fn refused(what: &str) -> Fault {
    Fault::statement(format!(
        "{what} is refused: a query reads the tables and changes nothing (SELECT, WITH, VALUES, EXPLAIN, DESCRIBE, SHOW TABLES)"
    ))
}

fn only_reads(statement: &Statement) -> Result<(), Fault> {
    match statement {
        Statement::Statement(inner) => match inner.as_ref() {
            ast::Statement::Query(query) => reads(query),
            ast::Statement::Explain { statement, .. } => {
                only_reads(&Statement::Statement(statement.clone()))
            }
            ast::Statement::ExplainTable { .. } | ast::Statement::ShowTables { .. } => Ok(()),
            other => Err(refused(&first_word(&other.to_string()))),
        },
        Statement::Explain(explain) => only_reads(&explain.statement),
        Statement::CopyTo(_) => Err(refused("COPY")),
        Statement::CreateExternalTable(_) => Err(refused("CREATE")),
        Statement::Reset(_) => Err(refused("RESET")),
    }
}

fn first_word(text: &str) -> String {
    text.split_whitespace()
        .next()
        .unwrap_or("this statement")
        .to_uppercase()
}

/// A query may hold an INSERT or an INTO in its body.
fn reads(query: &Query) -> Result<(), Fault> {
    fn body(set: &SetExpr) -> Result<(), Fault> {
        match set {
            SetExpr::Select(select) if select.into.is_some() => Err(refused("SELECT … INTO")),
            SetExpr::Select(_) | SetExpr::Values(_) | SetExpr::Table(_) => Ok(()),
            SetExpr::Query(query) => reads(query),
            SetExpr::SetOperation { left, right, .. } => body(left).and_then(|()| body(right)),
            other => Err(refused(&first_word(&other.to_string()))),
        }
    }
    for cte in query.with.iter().flat_map(|with| &with.cte_tables) {
        reads(&cte.query)?;
    }
    if !query.locks.is_empty() {
        return Err(refused("FOR UPDATE"));
    }
    body(&query.body)
}

fn rewrite(statement: &mut Statement) -> Result<(), Fault> {
    match statement {
        Statement::Statement(inner) => {
            joins::rewrite(inner)?;
            let _: ControlFlow<()> = visit_expressions_mut(inner, |expr| {
                meaning::rounded_cast(expr);
                ControlFlow::Continue(())
            });
            if let ast::Statement::Query(query) = inner.as_mut() {
                name_columns(&mut query.body);
            }
            Ok(())
        }
        Statement::Explain(explain) => rewrite(&mut explain.statement),
        _ => Ok(()),
    }
}

/// Names the columns of the answer as they are written, and one that comes twice with a number.
fn name_columns(body: &mut SetExpr) {
    let select = match body {
        SetExpr::Select(select) => select,
        SetExpr::Query(query) => return name_columns(&mut query.body),
        SetExpr::SetOperation { left, .. } => return name_columns(left),
        _ => return,
    };
    let mut taken: Vec<String> = Vec::new();
    for item in &mut select.projection {
        let (name, written) = match &item {
            SelectItem::UnnamedExpr(Expr::Identifier(name)) => (name.value.clone(), true),
            SelectItem::UnnamedExpr(Expr::CompoundIdentifier(parts)) => {
                let last = parts.last().map(|p| p.value.clone());
                (last.unwrap_or_default(), true)
            }
            SelectItem::UnnamedExpr(expr) => (meaning::as_written(expr), false),
            SelectItem::ExprWithAlias { alias, .. } => {
                taken.push(alias.value.clone());
                continue;
            }
            _ => continue,
        };
        let mut unique = name.clone();
        let mut n = 0;
        while taken.contains(&unique) {
            n += 1;
            unique = format!("{name}_{n}");
        }
        taken.push(unique.clone());
        if written && n == 0 {
            continue;
        }
        if let SelectItem::UnnamedExpr(expr) = item {
            *item = SelectItem::ExprWithAlias {
                expr: expr.clone(),
                alias: Ident::with_quote('"', unique),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_something_is_refused_by_name() {
        for (sql, name) in [
            ("DELETE FROM scores", "DELETE"),
            ("INSERT INTO scores VALUES (1)", "INSERT"),
            ("UPDATE scores SET mean = 1", "UPDATE"),
            ("CREATE TABLE t AS SELECT 1", "CREATE"),
            ("CREATE VIEW t AS SELECT 1", "CREATE"),
            (
                "CREATE EXTERNAL TABLE t STORED AS CSV LOCATION '/etc/passwd'",
                "CREATE",
            ),
            ("DROP TABLE scores", "DROP"),
            ("ALTER TABLE scores ADD COLUMN x INT", "ALTER"),
            ("TRUNCATE TABLE scores", "TRUNCATE"),
            ("COPY scores TO 'x.csv'", "COPY"),
            ("SET x = 1", "SET"),
            ("RESET datafusion.execution.batch_size", "RESET"),
            ("SELECT 1 INTO t", "INTO"),
            (
                "WITH a AS (SELECT 1) INSERT INTO t SELECT * FROM a",
                "INSERT",
            ),
            ("EXPLAIN DELETE FROM scores", "DELETE"),
            ("BEGIN", "BEGIN"),
        ] {
            let fault = parse(sql).expect_err(sql).to_string();
            assert!(fault.contains(name), "{sql}: {fault}");
            assert!(fault.contains("is refused"), "{sql}: {fault}");
        }
    }

    #[test]
    fn one_statement_is_asked_for() {
        let fault = |sql: &str| parse(sql).expect_err(sql).to_string();
        assert!(fault("").contains("got nothing"));
        assert!(fault("SELECT 1; SELECT 2").contains("expected one statement, got 2"));
        assert!(fault("SELEC 1").contains("found: SELEC"));
        assert!(parse("SELECT 1;").is_ok());
    }

    #[test]
    fn columns_are_called_as_they_are_written() {
        let named = |sql: &str| match parse(sql).unwrap() {
            Statement::Statement(s) => s.to_string(),
            other => panic!("{other:?}"),
        };
        assert_eq!(
            named("SELECT k, AVG(x - y), COUNT(*), COUNT(*), t.k, z AS z FROM t"),
            "SELECT k, AVG(x - y) AS \"AVG(x - y)\", COUNT(*) AS \"COUNT(*)\", \
             COUNT(*) AS \"COUNT(*)_1\", t.k AS \"k_1\", z AS z FROM t"
        );
    }
}
