//! Sorts that use what is known of a table's files.
//!
//! Rows come file by file, in the order of the files' paths: a sort by the path's keys and more is one of each file by
//! what is left. For the first rows of a sort, row groups are read best first, and those that cannot have one of them
//! are left out.

use crate::sql::scan::{BATCH, ScanExec};
use datafusion::arrow::array::{ArrayRef, RecordBatch};
use datafusion::arrow::compute::concat_batches;
use datafusion::common::config::ConfigOptions;
use datafusion::common::tree_node::{Transformed, TransformedResult, TreeNode, TreeNodeRecursion};
use datafusion::common::utils::memory::get_record_batch_memory_size;
use datafusion::common::utils::{evaluate_partition_ranges, get_row_at_idx};
use datafusion::common::{Result, ScalarValue};
use datafusion::execution::memory_pool::{MemoryConsumer, MemoryReservation};
use datafusion::execution::{SendableRecordBatchStream, TaskContext};
use datafusion::physical_expr::{LexOrdering, PhysicalExpr};
use datafusion::physical_optimizer::PhysicalOptimizerRule;
use datafusion::physical_plan::coop::CooperativeExec;
use datafusion::physical_plan::execution_plan::{
    Boundedness, ChildrenPropertiesMode, EmissionType, ReplaceChildrenOptions,
};
use datafusion::physical_plan::filter::FilterExec;
use datafusion::physical_plan::projection::ProjectionExec;
use datafusion::physical_plan::sort_pushdown::SortOrderPushdownResult;
use datafusion::physical_plan::sorts::sort::{SortExec, sort_batch};
use datafusion::physical_plan::stream::RecordBatchStreamAdapter;
use datafusion::physical_plan::{
    DisplayAs, DisplayFormatType, ExecutionPlan, ExecutionPlanProperties, PlanProperties,
};
use futures_util::{StreamExt, stream};
use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;

/// A file that is sorted in memory at once, in bytes; larger ones are left to a sort that uses temporary files.
const FILE: usize = 128 << 20;

/// The rule that reads row groups best first where only the first rows are asked for.
#[derive(Debug)]
pub(crate) struct BestFirst;

impl PhysicalOptimizerRule for BestFirst {
    fn optimize(
        &self,
        plan: Arc<dyn ExecutionPlan>,
        _: &ConfigOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        plan.transform_down(|plan| {
            if let Some(sort) = plan.downcast_ref::<SortExec>()
                && let Some(fetch) = sort.fetch()
                && let SortOrderPushdownResult::Inexact { inner } =
                    sort.input().try_pushdown_sort(sort.expr())?
            {
                let sort = SortExec::new(sort.expr().clone(), inner).with_fetch(Some(fetch));
                let sort = Arc::new(sort) as Arc<dyn ExecutionPlan>;
                return Ok(Transformed::new(sort, true, TreeNodeRecursion::Jump));
            }
            Ok(Transformed::no(plan))
        })
        .data()
    }

    fn name(&self) -> &'static str {
        "BestFirst"
    }

    fn schema_check(&self) -> bool {
        true
    }
}

/// The rule that sorts file by file.
#[derive(Debug)]
pub(crate) struct FileByFile;

impl PhysicalOptimizerRule for FileByFile {
    fn optimize(
        &self,
        plan: Arc<dyn ExecutionPlan>,
        _: &ConfigOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        plan.transform_up(|plan| {
            let Some(sort) = plan.downcast_ref::<SortExec>() else {
                return Ok(Transformed::no(plan));
            };
            Ok(match by_file(sort)? {
                Some(runs) => Transformed::yes(Arc::new(runs)),
                None => Transformed::no(plan),
            })
        })
        .data()
    }

    fn name(&self) -> &'static str {
        "FileByFile"
    }

    fn schema_check(&self) -> bool {
        true
    }
}

fn by_file(sort: &SortExec) -> Result<Option<RunSortExec>> {
    let input = sort.input();
    if sort.fetch().is_some() || input.output_partitioning().partition_count() != 1 {
        return Ok(None);
    }
    let Some(scan) = scan_below(input) else {
        return Ok(None);
    };
    let wanted = sort.expr().clone();
    let (known, _) = input
        .equivalence_properties()
        .extract_common_sort_prefix(wanted.clone())?;
    // Constants may be left out of what is known: count what the statement has of it.
    let prefix = wanted
        .iter()
        .take_while(|e| known.iter().any(|k| k.expr.eq(&e.expr)))
        .count();
    let whole = scan.keys_in_order();
    if prefix == 0 || prefix < whole || prefix == wanted.len() || scan.largest_file() > FILE {
        return Ok(None);
    }
    Ok(RunSortExec::new(Arc::clone(input), wanted, prefix))
}

/// The scan whose rows these are, each as it was read.
fn scan_below(plan: &Arc<dyn ExecutionPlan>) -> Option<&ScanExec> {
    if let Some(scan) = plan.downcast_ref::<ScanExec>() {
        return Some(scan);
    }
    let of_rows = plan.is::<ProjectionExec>()
        || plan.is::<CooperativeExec>()
        || plan
            .downcast_ref::<FilterExec>()
            .is_some_and(|f| f.fetch().is_none());
    match plan.children().as_slice() {
        [child] if of_rows => scan_below(child),
        _ => None,
    }
}

/// Sorts runs of rows that are equal in the first columns, in which the input is sorted already.
#[derive(Debug)]
struct RunSortExec {
    input: Arc<dyn ExecutionPlan>,
    order: LexOrdering,
    prefix: usize,
    rest: LexOrdering,
    properties: Arc<PlanProperties>,
}

impl RunSortExec {
    fn new(input: Arc<dyn ExecutionPlan>, order: LexOrdering, prefix: usize) -> Option<Self> {
        let rest = LexOrdering::new(order.iter().skip(prefix).cloned())?;
        let mut known = input.equivalence_properties().clone();
        known.reorder(order.iter().cloned()).ok()?;
        let properties = PlanProperties::new(
            known,
            input.output_partitioning().clone(),
            EmissionType::Incremental,
            Boundedness::Bounded,
        );
        Some(Self {
            input,
            order,
            prefix,
            rest,
            properties: Arc::new(properties),
        })
    }

    fn again(&self, mut children: Vec<Arc<dyn ExecutionPlan>>) -> Result<Arc<dyn ExecutionPlan>> {
        let input = children.swap_remove(0);
        match Self::new(Arc::clone(&input), self.order.clone(), self.prefix) {
            Some(sorted) => Ok(Arc::new(sorted)),
            None => Ok(Arc::new(SortExec::new(self.order.clone(), input))),
        }
    }
}

impl DisplayAs for RunSortExec {
    fn fmt_as(&self, _: DisplayFormatType, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "RunSortExec: [{}], sorted={}", self.order, self.prefix)
    }
}

impl ExecutionPlan for RunSortExec {
    fn name(&self) -> &'static str {
        "RunSortExec"
    }

    fn properties(&self) -> &Arc<PlanProperties> {
        &self.properties
    }

    fn children(&self) -> Vec<&Arc<dyn ExecutionPlan>> {
        vec![&self.input]
    }

    fn apply_expressions(
        &self,
        f: &mut dyn FnMut(&Arc<dyn PhysicalExpr>) -> Result<TreeNodeRecursion>,
    ) -> Result<TreeNodeRecursion> {
        for sorted in self.order.iter() {
            if f(&sorted.expr)? == TreeNodeRecursion::Stop {
                return Ok(TreeNodeRecursion::Stop);
            }
        }
        Ok(TreeNodeRecursion::Continue)
    }

    fn maintains_input_order(&self) -> Vec<bool> {
        vec![false]
    }

    fn replace_children(
        self: Arc<Self>,
        children: Vec<Arc<dyn ExecutionPlan>>,
        _: ReplaceChildrenOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        self.again(children)
    }

    fn with_new_children(
        self: Arc<Self>,
        children: Vec<Arc<dyn ExecutionPlan>>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let options = ReplaceChildrenOptions::new(ChildrenPropertiesMode::Recompute);
        self.replace_children(children, options)
    }

    fn execute(&self, part: usize, context: Arc<TaskContext>) -> Result<SendableRecordBatchStream> {
        let memory = MemoryConsumer::new("RunSort").register(context.memory_pool());
        let sorting = Sorting {
            input: self.input.execute(part, context)?,
            order: self.order.clone(),
            prefix: self.prefix,
            rest: self.rest.clone(),
            memory,
            run: None,
            sorted: Vec::new(),
            ready: VecDeque::new(),
            ended: false,
        };
        let batches = stream::unfold(Some(sorting), |sorting| async move {
            let mut sorting = sorting?;
            match sorting.next().await {
                Ok(None) => None,
                Ok(Some(batch)) => Some((Ok(batch), Some(sorting))),
                Err(e) => Some((Err(e), None)),
            }
        });
        Ok(Box::pin(RecordBatchStreamAdapter::new(
            self.schema(),
            batches,
        )))
    }
}

struct Sorting {
    input: SendableRecordBatchStream,
    order: LexOrdering,
    prefix: usize,
    rest: LexOrdering,
    memory: MemoryReservation,
    /// What the rows of the run have in common, and those rows.
    run: Option<(Vec<ScalarValue>, Vec<RecordBatch>)>,
    /// Sorted runs that are too short to be given alone.
    sorted: Vec<RecordBatch>,
    ready: VecDeque<RecordBatch>,
    ended: bool,
}

impl Sorting {
    async fn next(&mut self) -> Result<Option<RecordBatch>> {
        loop {
            if let Some(batch) = self.ready.pop_front() {
                return Ok(Some(batch));
            }
            if self.ended {
                return Ok(None);
            }
            match self.input.next().await {
                Some(batch) => self.take(&batch?)?,
                None => {
                    self.finish_run()?;
                    self.give()?;
                    self.ended = true;
                }
            }
        }
    }

    fn take(&mut self, batch: &RecordBatch) -> Result<()> {
        let known = self.order.iter().take(self.prefix);
        let columns = known
            .map(|e| e.evaluate_to_sort_column(batch))
            .collect::<Result<Vec<_>>>()?;
        let values: Vec<ArrayRef> = columns.iter().map(|c| Arc::clone(&c.values)).collect();
        for range in evaluate_partition_ranges(batch.num_rows(), &columns)? {
            let key = get_row_at_idx(&values, range.start)?;
            let rows = batch.slice(range.start, range.len());
            self.memory.try_grow(get_record_batch_memory_size(&rows))?;
            match &mut self.run {
                Some((of_run, run)) if *of_run == key => run.push(rows),
                _ => {
                    self.finish_run()?;
                    self.run = Some((key, vec![rows]));
                }
            }
        }
        Ok(())
    }

    fn finish_run(&mut self) -> Result<()> {
        let Some((_, run)) = self.run.take() else {
            return Ok(());
        };
        let run = concat_batches(&self.input.schema(), &run)?;
        self.sorted.push(sort_batch(&run, &self.rest, None)?);
        if self.sorted.iter().map(RecordBatch::num_rows).sum::<usize>() >= BATCH {
            self.give()?;
        }
        Ok(())
    }

    fn give(&mut self) -> Result<()> {
        let sorted = std::mem::take(&mut self.sorted);
        let whole = concat_batches(&self.input.schema(), &sorted)?;
        let starts = (0..whole.num_rows()).step_by(BATCH);
        let parts = starts.map(|i| whole.slice(i, BATCH.min(whole.num_rows() - i)));
        self.ready.extend(parts);
        self.memory.free();
        Ok(())
    }
}
