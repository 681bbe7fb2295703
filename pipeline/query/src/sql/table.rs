//! A table: Parquet files in folders `key=value`, whose values are columns of text.

use crate::sql::fault::Fault;
use crate::sql::pruning;
use crate::sql::scan::{Opened, Scan, ScanExec, Stamp, stamp};
use async_trait::async_trait;
use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{
    ArrayRef, BooleanArray, RecordBatch, RecordBatchOptions, StringViewArray,
};
use datafusion::arrow::datatypes::{DataType, Field, Schema, SchemaRef};
use datafusion::catalog::{Session, TableProvider};
use datafusion::common::{DFSchema, DataFusionError, Result};
use datafusion::logical_expr::{Expr, TableProviderFilterPushDown, TableType};
use datafusion::physical_expr::PhysicalExpr;
use datafusion::physical_expr::utils::{collect_columns, conjunction, reassign_expr_columns};
use datafusion::physical_plan::ExecutionPlan;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of a table.
#[derive(Clone, Debug)]
pub struct File {
    /// Where it lies.
    pub path: PathBuf,
    /// What its path says: a value for each of the table's keys.
    pub keys: Vec<String>,
}

/// A table by name. All its files have the same columns, and none of them is one of the keys.
#[derive(Clone, Debug)]
pub struct Table {
    /// Its name.
    pub name: String,
    /// The names of the keys in its files' paths.
    pub keys: Vec<String>,
    /// Its files, in the order in which their rows come.
    pub files: Vec<File>,
}

/// A table whose columns are known, as DataFusion sees it.
#[derive(Debug)]
pub(crate) struct Provider {
    table: Table,
    /// The files' columns, then the keys.
    schema: SchemaRef,
}

impl Provider {
    /// Reads the columns from the first file.
    pub(crate) fn open(table: Table) -> Result<Self> {
        let Some(first) = table.files.first() else {
            return Err(DataFusionError::Plan(format!(
                "the table `{}` has no files",
                table.name
            )));
        };
        let (footer, _) = footer(&first.path)?;
        let keys = table
            .keys
            .iter()
            .map(|key| Field::new(key, DataType::Utf8View, false));
        let columns = footer.schema().fields().iter().map(|f| f.as_ref().clone());
        let schema = Arc::new(Schema::new(columns.chain(keys).collect::<Vec<_>>()));
        Ok(Self { table, schema })
    }

    fn file_columns(&self) -> usize {
        self.schema.fields().len() - self.table.keys.len()
    }

    /// The files whose paths meet the conditions, which speak of keys alone.
    fn files_that_meet(&self, conditions: &[Arc<dyn PhysicalExpr>]) -> Result<Vec<&File>> {
        let n = self.table.files.len();
        let mut columns: Vec<ArrayRef> = Vec::new();
        for i in 0..self.schema.fields().len() {
            columns.push(match i.checked_sub(self.file_columns()) {
                Some(key) => Arc::new(StringViewArray::from_iter_values(
                    self.table.files.iter().map(|file| &file.keys[key]),
                )),
                None => {
                    datafusion::arrow::array::new_null_array(self.schema.field(i).data_type(), n)
                }
            });
        }
        // The files' own columns are not looked at, so that it does not matter that they hold nothing here.
        let nullable: Vec<Field> = self
            .schema
            .fields()
            .iter()
            .map(|f| f.as_ref().clone().with_nullable(true))
            .collect();
        let options = RecordBatchOptions::new().with_row_count(Some(n));
        let paths =
            RecordBatch::try_new_with_options(Arc::new(Schema::new(nullable)), columns, &options)?;
        let mut meets = vec![true; n];
        for condition in conditions {
            let found = condition.evaluate(&paths)?.into_array(n)?;
            let found: &BooleanArray = found.as_boolean();
            for (meets, found) in meets.iter_mut().zip(found) {
                *meets &= found == Some(true);
            }
        }
        let files = self.table.files.iter().zip(meets);
        Ok(files.filter(|(_, meets)| *meets).map(|(f, _)| f).collect())
    }
}

#[async_trait]
impl TableProvider for Provider {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }

    fn table_type(&self) -> TableType {
        TableType::Base
    }

    fn supports_filters_pushdown(
        &self,
        filters: &[&Expr],
    ) -> Result<Vec<TableProviderFilterPushDown>> {
        Ok(filters
            .iter()
            .map(|filter| {
                if filter.is_volatile() || filter.contains_outer() || asks(filter) {
                    TableProviderFilterPushDown::Unsupported
                } else {
                    TableProviderFilterPushDown::Exact
                }
            })
            .collect())
    }

    async fn scan(
        &self,
        state: &dyn Session,
        projection: Option<&Vec<usize>>,
        filters: &[Expr],
        limit: Option<usize>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let own = DFSchema::try_from(self.schema.as_ref().clone())?;
        let (mut of_keys, mut of_rows) = (Vec::new(), Vec::new());
        for filter in filters {
            let filter = state.create_physical_expr(filter.clone(), &own)?;
            let columns = collect_columns(&filter);
            if columns.iter().all(|c| c.index() >= self.file_columns()) {
                of_keys.push(filter);
            } else {
                of_rows.push(filter);
            }
        }
        let output: Vec<usize> =
            projection.map_or_else(|| (0..self.schema.fields().len()).collect(), Clone::clone);
        let condition = (!of_rows.is_empty()).then(|| conjunction(of_rows));
        let mut read = output.clone();
        if let Some(condition) = &condition {
            read.extend(collect_columns(condition).iter().map(|c| c.index()));
        }
        read.sort_unstable();
        read.dedup();
        let read_schema = Arc::new(self.schema.project(&read)?);
        let mut opened = Vec::new();
        let mut parts = Vec::new();
        for file in self.files_that_meet(&of_keys)? {
            let (footer, stamp) = footer(&file.path)?;
            self.same_columns(&file.path, footer.schema())?;
            let kept = match &condition {
                Some(condition) => pruning::row_groups(condition, &self.schema, &footer),
                None => vec![true; footer.metadata().num_row_groups()],
            };
            let index = opened.len();
            parts.extend((0..kept.len()).filter(|i| kept[*i]).map(|i| (index, i)));
            opened.push(Opened {
                path: file.path.clone(),
                keys: file.keys.clone(),
                footer,
                stamp,
            });
        }
        let place = |i: &usize| read.binary_search(i).expect("all that is given is read");
        let scan = Scan {
            table: self.table.name.clone(),
            file_columns: read
                .iter()
                .copied()
                .filter(|i| *i < self.file_columns())
                .collect(),
            keys: read
                .iter()
                .filter_map(|i| i.checked_sub(self.file_columns()))
                .collect(),
            condition: condition
                .map(|c| reassign_expr_columns(c, &read_schema))
                .transpose()?,
            output: output.iter().map(place).collect(),
            schema: Arc::new(self.schema.project(&output)?),
            read_schema,
            files: opened,
            parts,
            limit,
        };
        Ok(Arc::new(ScanExec::new(Arc::new(scan))))
    }
}

impl Provider {
    fn same_columns(&self, path: &Path, schema: &Schema) -> Result<()> {
        let own = &self.schema.fields()[..self.file_columns()];
        let same = |(a, b): (&Arc<Field>, &Arc<Field>)| {
            a.name() == b.name() && a.data_type() == b.data_type()
        };
        if own.len() == schema.fields().len() && own.iter().zip(schema.fields()).all(same) {
            return Ok(());
        }
        let names = |fields: &[Arc<Field>]| {
            let names: Vec<&str> = fields.iter().map(|f| f.name().as_str()).collect();
            names.join(", ")
        };
        let message = format!(
            "expected the columns of the table's other files ({}), got {}",
            names(own),
            names(schema.fields())
        );
        Err(file_fault(path, message))
    }
}

/// True if the expression asks another query.
fn asks(expr: &Expr) -> bool {
    use datafusion::common::tree_node::TreeNode;
    expr.exists(|e| {
        Ok(matches!(
            e,
            Expr::ScalarSubquery(_) | Expr::InSubquery(_) | Expr::Exists(_)
        ))
    })
    .unwrap_or(true)
}

pub(crate) fn file_fault(path: &Path, message: impl ToString) -> DataFusionError {
    DataFusionError::External(Box::new(Fault::File {
        path: path.to_owned(),
        message: message.to_string(),
    }))
}

/// The footer of a file, whose texts are to be read as views into its pages.
fn footer(path: &Path) -> Result<(ArrowReaderMetadata, Stamp)> {
    let file = std::fs::File::open(path).map_err(|e| file_fault(path, e))?;
    let stored = ArrowReaderMetadata::load(&file, ArrowReaderOptions::new())
        .map_err(|e| file_fault(path, e))?;
    let fields: Vec<Field> = stored
        .schema()
        .fields()
        .iter()
        .map(|f| {
            let kind = match f.data_type() {
                DataType::Utf8 => DataType::Utf8View,
                other => other.clone(),
            };
            Field::new(f.name(), kind, f.is_nullable())
        })
        .collect();
    let options = ArrowReaderOptions::new().with_schema(Arc::new(Schema::new(fields)));
    let footer = ArrowReaderMetadata::try_new(Arc::clone(stored.metadata()), options)
        .map_err(|e| file_fault(path, e))?;
    let stamp = stamp(&file).map_err(|e| file_fault(path, e))?;
    Ok((footer, stamp))
}
