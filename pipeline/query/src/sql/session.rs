//! One statement, from its text to its rows.

use crate::sql::answer::Answer;
use crate::sql::fault::{Fault, missing_table};
use crate::sql::format::{Format, Printer};
use crate::sql::meaning::{self, Meaning};
use crate::sql::order::{BestFirst, FileByFile};
use crate::sql::partial::InShares;
use crate::sql::scan::BATCH;
use crate::sql::statement;
use crate::sql::table::{Provider, Table};
use async_trait::async_trait;
use datafusion::arrow::array::RecordBatch;
use datafusion::arrow::datatypes::SchemaRef;
use datafusion::catalog::{CatalogProvider, MemoryCatalogProvider, SchemaProvider, TableProvider};
use datafusion::common::{DataFusionError, TableReference};
use datafusion::execution::FunctionRegistry as _;
use datafusion::execution::context::SQLOptions;
use datafusion::execution::memory_pool::FairSpillPool;
use datafusion::execution::runtime_env::RuntimeEnvBuilder;
use datafusion::execution::session_state::{SessionState, SessionStateBuilder};
use datafusion::physical_optimizer::PhysicalOptimizerRule;
use datafusion::physical_optimizer::optimizer::PhysicalOptimizer;
use datafusion::physical_plan::{ExecutionPlan, execute_stream};
use datafusion::prelude::SessionConfig;
use futures_util::StreamExt;
use std::io::Write;
use std::sync::Arc;

/// What sorting, joining and grouping may hold, in bytes; sorting and grouping go on in temporary files.
pub(crate) const MEMORY: usize = 512 << 20;
/// Plans are trees that are walked by recursion.
const STACK: usize = 64 << 20;

/// The answer to a statement over these tables.
pub fn run(tables: Vec<Table>, sql: &str) -> Result<Answer, Fault> {
    in_own_thread(|| {
        let mut batches = Vec::new();
        let schema = each(tables, sql, &mut |_, batch| {
            batches.push(batch);
            Ok(())
        })?;
        Ok(Answer::new(&schema, batches))
    })
}

/// Writes the answer to a statement over these tables, as it comes.
pub fn print(
    tables: Vec<Table>,
    sql: &str,
    format: Format,
    out: &mut (dyn Write + Send),
) -> Result<(), Fault> {
    in_own_thread(|| {
        let mut printer = None;
        let mut out = Some(out as &mut dyn Write);
        each(tables, sql, &mut |schema, batch| {
            let part = Answer::new(schema, vec![batch]);
            if let Some(out) = out.take() {
                printer = Some(Printer::new(format, part.columns().to_vec(), out)?);
            }
            let printer = printer.as_mut().expect("made with the first part");
            Ok(printer.part(&part)?)
        })?;
        let printer = printer.expect("there is a part, if an empty one");
        Ok(printer.end()?)
    })
}

/// Runs `work` on a stack that is deep enough; a panic in it is an error.
fn in_own_thread<T: Send>(work: impl FnOnce() -> Result<T, Fault> + Send) -> Result<T, Fault> {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name("query".to_owned())
            .stack_size(STACK)
            .spawn_scoped(scope, work)?
            .join()
            .unwrap_or_else(|_| {
                Err(Fault::statement(
                    "this statement cannot be run: the engine has failed on it",
                ))
            })
    })
}

/// Gives the schema and each batch of the answer, one that is empty if there is none.
fn each(
    tables: Vec<Table>,
    sql: &str,
    consume: &mut dyn FnMut(&SchemaRef, RecordBatch) -> Result<(), Fault>,
) -> Result<SchemaRef, Fault> {
    let statement = statement::parse(sql)?;
    let state = state(tables)?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .map_err(Fault::Output)?;
    runtime.block_on(async {
        known_tables(&state, &statement)?;
        let plan = plan(&state, statement).await.map_err(Fault::of)?;
        let schema = plan.schema();
        let mut stream = execute_stream(plan, state.task_ctx()).map_err(Fault::of)?;
        consume(&schema, RecordBatch::new_empty(Arc::clone(&schema)))?;
        while let Some(batch) = stream.next().await {
            consume(&schema, batch.map_err(Fault::of)?)?;
        }
        Ok(schema)
    })
}

async fn plan(
    state: &SessionState,
    statement: datafusion::sql::parser::Statement,
) -> Result<Arc<dyn ExecutionPlan>, DataFusionError> {
    let plan = state.statement_to_plan(statement).await?;
    SQLOptions::new()
        .with_allow_ddl(false)
        .with_allow_dml(false)
        .with_allow_statements(false)
        .verify_plan(&plan)?;
    state.create_physical_plan(&plan).await
}

/// Every table that the statement names is there.
fn known_tables(
    state: &SessionState,
    statement: &datafusion::sql::parser::Statement,
) -> Result<(), Fault> {
    let names = names(state);
    for reference in state
        .resolve_table_references(statement)
        .map_err(Fault::of)?
    {
        let known = match &reference {
            TableReference::Bare { table } => names.iter().any(|n| **n == **table),
            TableReference::Partial { schema, table } => {
                &**schema == "information_schema"
                    || (&**schema == SCHEMA && names.iter().any(|n| **n == **table))
            }
            TableReference::Full { .. } => false,
        };
        if !known {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            return Err(missing_table(&reference.to_string(), &known));
        }
    }
    Ok(())
}

const CATALOG: &str = "lake";
const SCHEMA: &str = "main";

fn names(state: &SessionState) -> Vec<String> {
    let catalog = state.catalog_list().catalog(CATALOG);
    let schema = catalog.and_then(|c| c.schema(SCHEMA));
    schema.map_or_else(Vec::new, |s| s.table_names())
}

/// A session that knows these tables. One stream of rows: every operator sees them in one order.
fn state(tables: Vec<Table>) -> Result<SessionState, Fault> {
    let mut config = SessionConfig::new()
        .with_target_partitions(1)
        .with_batch_size(BATCH)
        .with_information_schema(true)
        .with_create_default_catalog_and_schema(false)
        .with_default_catalog_and_schema(CATALOG, SCHEMA);
    // Missing values come last, as in DuckDB.
    config.options_mut().sql_parser.default_null_ordering = "nulls_last".to_owned();
    // Only those that sorts make of their first rows are cheap enough to look at in every row.
    config
        .options_mut()
        .optimizer
        .enable_join_dynamic_filter_pushdown = false;
    config
        .options_mut()
        .optimizer
        .enable_aggregate_dynamic_filter_pushdown = false;
    let runtime = RuntimeEnvBuilder::new()
        .with_memory_pool(Arc::new(FairSpillPool::new(MEMORY)))
        .build_arc()
        .map_err(Fault::of)?;
    let mut state = SessionStateBuilder::new()
        .with_config(config)
        .with_runtime_env(runtime)
        .with_expr_planners(vec![Arc::new(Meaning)])
        .with_default_features()
        .with_physical_optimizer_rules(rules())
        .build();
    // After the usual ones, some of which they stand in for.
    for function in meaning::functions() {
        state.register_udf(function).map_err(Fault::of)?;
    }
    let catalog = MemoryCatalogProvider::new();
    let schema = Tables { tables };
    catalog
        .register_schema(SCHEMA, Arc::new(schema))
        .map_err(Fault::of)?;
    state
        .catalog_list()
        .register_catalog(CATALOG.to_owned(), Arc::new(catalog));
    Ok(state)
}

/// DataFusion's rules for plans, and ours.
fn rules() -> Vec<Arc<dyn PhysicalOptimizerRule + Send + Sync>> {
    let mut rules = PhysicalOptimizer::new().rules;
    for rule in &mut rules {
        if rule.name() == "PushdownSort" {
            *rule = Arc::new(BestFirst);
        }
    }
    rules.push(Arc::new(FileByFile));
    rules.push(Arc::new(InShares));
    rules
}

/// The tables by name. The columns of one are read when a statement asks for it.
#[derive(Debug)]
struct Tables {
    tables: Vec<Table>,
}

#[async_trait]
impl SchemaProvider for Tables {
    fn table_names(&self) -> Vec<String> {
        self.tables.iter().map(|t| t.name.clone()).collect()
    }

    async fn table(&self, name: &str) -> Result<Option<Arc<dyn TableProvider>>, DataFusionError> {
        match self.tables.iter().find(|t| t.name == name) {
            Some(table) => Ok(Some(Arc::new(Provider::open(table.clone())?))),
            None => Ok(None),
        }
    }

    fn table_exist(&self, name: &str) -> bool {
        self.tables.iter().any(|t| t.name == name)
    }
}
