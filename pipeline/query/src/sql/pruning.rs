//! Row groups that a condition cannot meet, by the least and greatest values in a file's footer.

use crate::sql::scan::Opened;
use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{ArrayRef, BooleanArray, UInt64Array};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Float64Type, Schema, SchemaRef};
use datafusion::common::pruning::PruningStatistics;
use datafusion::common::{Column, ScalarValue};
use datafusion::physical_expr::PhysicalExpr;
use datafusion::physical_expr_common::physical_expr::snapshot_generation;
use datafusion::physical_optimizer::pruning::{PruningPredicate, PruningPredicateBuilder};
use parquet::arrow::arrow_reader::ArrowReaderMetadata;
use parquet::arrow::arrow_reader::statistics::StatisticsConverter;
use parquet::file::metadata::RowGroupMetaData;
use std::collections::HashSet;
use std::sync::{Arc, Mutex, PoisonError};

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
    let kept = predicate.prune(&Footer::new(footer));
    kept.ok().filter(|kept| kept.len() == n).unwrap_or(all)
}

/// A condition that becomes narrower while a plan runs, and what it was when it was last looked at.
#[derive(Clone, Debug)]
pub(crate) struct Later {
    pub(crate) condition: Arc<dyn PhysicalExpr>,
    built: Arc<Mutex<Built>>,
}

/// The state of a condition, and what it leaves out in that state: nothing where there is no predicate.
type Built = Option<(u64, Option<Arc<PruningPredicate>>)>;

impl Later {
    pub(crate) fn new(condition: Arc<dyn PhysicalExpr>) -> Self {
        Self {
            condition,
            built: Arc::default(),
        }
    }

    /// False if no row of the row group can meet the condition as it is by now.
    pub(crate) fn may_meet(
        &self,
        schema: &SchemaRef,
        footer: &ArrowReaderMetadata,
        group: usize,
    ) -> bool {
        let state = snapshot_generation(&self.condition);
        let predicate = {
            let mut built = self.built.lock().unwrap_or_else(PoisonError::into_inner);
            match built.as_ref() {
                Some((of, predicate)) if *of == state => predicate.clone(),
                _ => {
                    let predicate = PruningPredicateBuilder::new()
                        .with_file_schema(Arc::clone(schema))
                        .build(Arc::clone(&self.condition));
                    *built = Some((state, predicate.clone()));
                    predicate
                }
            }
        };
        let of_group = Footer {
            groups: &footer.metadata().row_groups()[group..=group],
            ..Footer::new(footer)
        };
        predicate
            .and_then(|predicate| predicate.prune(&of_group).ok())
            .is_none_or(|kept| kept != [false])
    }
}

/// The best value of a column in each row group of each file, greatest or least; None for a column that no footer
/// speaks of or that has no order as numbers.
pub(crate) fn best(
    column: &str,
    greatest: bool,
    files: &[Opened],
) -> Option<Vec<Vec<Option<f64>>>> {
    let column = Column::from_name(column);
    let of_file = |file: &Opened| {
        let footer = Footer::new(&file.footer);
        let values = if greatest {
            footer.max_values(&column)?
        } else {
            footer.min_values(&column)?
        };
        let numbers = cast(&values, &DataType::Float64).ok()?;
        Some(numbers.as_primitive::<Float64Type>().iter().collect())
    };
    files.iter().map(of_file).collect()
}

struct Footer<'a> {
    footer: &'a ArrowReaderMetadata,
    schema: &'a Schema,
    groups: &'a [RowGroupMetaData],
}

impl<'a> Footer<'a> {
    fn new(footer: &'a ArrowReaderMetadata) -> Self {
        Self {
            footer,
            schema: footer.schema(),
            groups: footer.metadata().row_groups(),
        }
    }

    fn converter(&self, column: &Column) -> Option<StatisticsConverter<'_>> {
        StatisticsConverter::try_new(column.name(), self.schema, self.footer.parquet_schema()).ok()
    }
}

impl PruningStatistics for Footer<'_> {
    fn min_values(&self, column: &Column) -> Option<ArrayRef> {
        self.converter(column)?.row_group_mins(self.groups).ok()
    }

    fn max_values(&self, column: &Column) -> Option<ArrayRef> {
        self.converter(column)?.row_group_maxes(self.groups).ok()
    }

    fn num_containers(&self) -> usize {
        self.groups.len()
    }

    fn null_counts(&self, column: &Column) -> Option<ArrayRef> {
        let counts = self
            .converter(column)?
            .row_group_null_counts(self.groups)
            .ok()?;
        Some(Arc::new(counts))
    }

    fn row_counts(&self) -> Option<ArrayRef> {
        let rows = self.groups.iter().map(|g| g.num_rows().try_into().ok());
        Some(Arc::new(rows.collect::<UInt64Array>()))
    }

    fn contained(&self, _: &Column, _: &HashSet<ScalarValue>) -> Option<BooleanArray> {
        None
    }
}
