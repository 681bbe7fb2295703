//! Row groups that a condition cannot meet, by the least and greatest values in a file's footer.

use datafusion::arrow::array::{ArrayRef, BooleanArray, UInt64Array};
use datafusion::arrow::datatypes::{Schema, SchemaRef};
use datafusion::common::pruning::PruningStatistics;
use datafusion::common::{Column, ScalarValue};
use datafusion::physical_expr::PhysicalExpr;
use datafusion::physical_optimizer::pruning::PruningPredicateBuilder;
use parquet::arrow::arrow_reader::ArrowReaderMetadata;
use parquet::arrow::arrow_reader::statistics::StatisticsConverter;
use std::collections::HashSet;
use std::sync::Arc;

/// For each row group of a file, whether a row of it may meet the condition over `schema`.
pub(crate) fn row_groups(
    condition: &Arc<dyn PhysicalExpr>,
    schema: &SchemaRef,
    footer: &ArrowReaderMetadata,
) -> Vec<bool> {
    let n = footer.metadata().num_row_groups();
    let all = vec![true; n];
    let built = PruningPredicateBuilder::new()
        .with_file_schema(Arc::clone(schema))
        .build(Arc::clone(condition));
    let Some(predicate) = built else {
        return all;
    };
    let kept = predicate.prune(&Footer {
        footer,
        schema: footer.schema(),
    });
    kept.ok().filter(|kept| kept.len() == n).unwrap_or(all)
}

struct Footer<'a> {
    footer: &'a ArrowReaderMetadata,
    schema: &'a Schema,
}

impl Footer<'_> {
    fn converter(&self, column: &Column) -> Option<StatisticsConverter<'_>> {
        StatisticsConverter::try_new(column.name(), self.schema, self.footer.parquet_schema()).ok()
    }
}

impl PruningStatistics for Footer<'_> {
    fn min_values(&self, column: &Column) -> Option<ArrayRef> {
        let groups = self.footer.metadata().row_groups();
        self.converter(column)?.row_group_mins(groups).ok()
    }

    fn max_values(&self, column: &Column) -> Option<ArrayRef> {
        let groups = self.footer.metadata().row_groups();
        self.converter(column)?.row_group_maxes(groups).ok()
    }

    fn num_containers(&self) -> usize {
        self.footer.metadata().num_row_groups()
    }

    fn null_counts(&self, column: &Column) -> Option<ArrayRef> {
        let groups = self.footer.metadata().row_groups();
        let counts = self.converter(column)?.row_group_null_counts(groups).ok()?;
        Some(Arc::new(counts))
    }

    fn row_counts(&self) -> Option<ArrayRef> {
        let groups = self.footer.metadata().row_groups();
        let rows = groups.iter().map(|g| g.num_rows().try_into().ok());
        Some(Arc::new(rows.collect::<UInt64Array>()))
    }

    fn contained(&self, _: &Column, _: &HashSet<ScalarValue>) -> Option<BooleanArray> {
        None
    }
}
