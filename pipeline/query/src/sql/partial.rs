//! Aggregates on all cores with the same bits.
//!
//! Threads that take rows as they come add floats in an order of their own. Here a table is cut into
//! [`SHARES`] runs of row groups, as many on any machine; each is aggregated by itself, in order, and the
//! results are put together in the order of the runs. What depends on the number of threads is the time.

use crate::sql::scan::ScanExec;
use datafusion::arrow::array::RecordBatch;
use datafusion::common::config::ConfigOptions;
use datafusion::common::tree_node::{Transformed, TransformedResult, TreeNode, TreeNodeRecursion};
use datafusion::common::{DataFusionError, Result};
use datafusion::execution::memory_pool::GreedyMemoryPool;
use datafusion::execution::runtime_env::RuntimeEnvBuilder;
use datafusion::execution::{SendableRecordBatchStream, TaskContext};
use datafusion::physical_expr::{EquivalenceProperties, PhysicalExpr};
use datafusion::physical_optimizer::PhysicalOptimizerRule;
use datafusion::physical_plan::aggregates::{AggregateExec, AggregateMode};
use datafusion::physical_plan::coalesce_partitions::CoalescePartitionsExec;
use datafusion::physical_plan::coop::CooperativeExec;
use datafusion::physical_plan::execution_plan::{
    Boundedness, ChildrenPropertiesMode, EmissionType, ReplaceChildrenOptions,
};
use datafusion::physical_plan::filter::FilterExec;
use datafusion::physical_plan::limit::GlobalLimitExec;
use datafusion::physical_plan::projection::ProjectionExec;
use datafusion::physical_plan::repartition::RepartitionExec;
use datafusion::physical_plan::sorts::sort_preserving_merge::SortPreservingMergeExec;
use datafusion::physical_plan::stream::RecordBatchStreamAdapter;
use datafusion::physical_plan::{
    DisplayAs, DisplayFormatType, ExecutionPlan, ExecutionPlanProperties, Partitioning,
    PlanProperties,
};
use futures_util::{StreamExt, stream};
use std::fmt;
use std::sync::Arc;
use tokio::sync::mpsc;

/// The runs of row groups that a table is cut into. Another number gives other bits.
const SHARES: usize = 8;
/// Fewer rows are not worth the threads. Another number gives other bits, too.
const WORTH: usize = 250_000;
/// What the groups of one share may hold before they are handed on unfinished. A pool for each share: in a
/// pool of all, which one is full first would be a matter of time.
const MEMORY: usize = crate::sql::session::MEMORY / (2 * SHARES);
/// Batches of a share that wait for their turn.
const WAITING: usize = 4;

/// Aggregates whose parts can be put together.
const DIVISIBLE: [&str; 13] = [
    "sum",
    "avg",
    "count",
    "min",
    "max",
    "stddev",
    "stddev_pop",
    "var",
    "var_pop",
    "bool_and",
    "bool_or",
    "corr",
    "covar_samp",
];

/// The rule that cuts them.
#[derive(Debug)]
pub(crate) struct InShares;

impl PhysicalOptimizerRule for InShares {
    fn optimize(
        &self,
        plan: Arc<dyn ExecutionPlan>,
        _: &ConfigOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let mut plan = plan.transform_up(in_order).data()?;
        if plan.output_partitioning().partition_count() > 1 {
            plan = Arc::new(InOrderExec::one_by_one(plan));
        }
        plan.transform_down(|plan| match plan.downcast_ref::<AggregateExec>() {
            Some(aggregate) => Ok(match cut(aggregate)? {
                Some(cut) => Transformed::new(cut, true, TreeNodeRecursion::Jump),
                None => Transformed::no(plan),
            }),
            None => Ok(Transformed::no(plan)),
        })
        .data()
    }

    fn name(&self) -> &'static str {
        "InShares"
    }

    fn schema_check(&self) -> bool {
        true
    }
}

/// What takes batches from several streams as they come, made to take them in order.
fn in_order(plan: Arc<dyn ExecutionPlan>) -> Result<Transformed<Arc<dyn ExecutionPlan>>> {
    if let Some(merge) = plan.downcast_ref::<CoalescePartitionsExec>() {
        let ordered = InOrderExec::one_by_one(Arc::clone(merge.input()));
        let ordered: Arc<dyn ExecutionPlan> = match merge.fetch() {
            Some(n) => Arc::new(GlobalLimitExec::new(Arc::new(ordered), 0, Some(n))),
            None => Arc::new(ordered),
        };
        return Ok(Transformed::yes(ordered));
    }
    if let Some(merge) = plan.downcast_ref::<RepartitionExec>()
        && merge.partitioning().partition_count() == 1
        && !merge.preserve_order()
    {
        let ordered = InOrderExec::one_by_one(Arc::clone(merge.input()));
        return Ok(Transformed::yes(Arc::new(ordered)));
    }
    if let Some(merge) = plan.downcast_ref::<SortPreservingMergeExec>() {
        let first = merge.clone().with_round_robin_repartition(false);
        return Ok(Transformed::yes(Arc::new(first)));
    }
    Ok(Transformed::no(plan))
}

/// The aggregate in two steps, if it can be had in two.
fn cut(aggregate: &AggregateExec) -> Result<Option<Arc<dyn ExecutionPlan>>> {
    let divisible = *aggregate.mode() == AggregateMode::Single
        && aggregate.limit_options().is_none()
        && !aggregate.group_expr().has_grouping_set()
        && aggregate.aggr_expr().iter().all(|a| {
            !a.is_distinct() && a.order_bys().is_empty() && DIVISIBLE.contains(&a.fun().name())
        });
    let Some(input) = divisible
        .then(|| in_shares(aggregate.input()))
        .transpose()?
        .flatten()
    else {
        return Ok(None);
    };
    let filters = aggregate.filter_expr().to_vec();
    let partial = AggregateExec::try_new(
        AggregateMode::Partial,
        aggregate.group_expr().clone(),
        aggregate.aggr_expr().to_vec(),
        filters.clone(),
        input,
        aggregate.input_schema(),
    )?;
    let aggregates = partial.aggr_expr().to_vec();
    let groups = partial.group_expr().as_final();
    let whole = AggregateExec::try_new(
        AggregateMode::Final,
        groups,
        aggregates,
        filters,
        Arc::new(InOrderExec::at_once(Arc::new(partial))),
        aggregate.input_schema(),
    )?;
    Ok((whole.schema() == aggregate.schema()).then(|| Arc::new(whole) as Arc<dyn ExecutionPlan>))
}

/// A scan, or what is done to each of its rows, in shares.
fn in_shares(plan: &Arc<dyn ExecutionPlan>) -> Result<Option<Arc<dyn ExecutionPlan>>> {
    if let Some(scan) = plan.downcast_ref::<ScanExec>() {
        let shared = (scan.rows() >= WORTH).then(|| scan.in_shares(SHARES));
        return Ok(shared
            .flatten()
            .map(|s| Arc::new(s) as Arc<dyn ExecutionPlan>));
    }
    let of_rows = plan.is::<ProjectionExec>()
        || plan.is::<CooperativeExec>()
        || plan
            .downcast_ref::<FilterExec>()
            .is_some_and(|f| f.fetch().is_none());
    if !of_rows {
        return Ok(None);
    }
    let children = plan.children();
    let [child] = children.as_slice() else {
        return Ok(None);
    };
    let Some(child) = in_shares(child)? else {
        return Ok(None);
    };
    let options = ReplaceChildrenOptions::new(ChildrenPropertiesMode::Recompute);
    Arc::clone(plan)
        .replace_children(vec![child], options)
        .map(Some)
}

/// The streams of its input, given out one after the other.
#[derive(Debug)]
struct InOrderExec {
    input: Arc<dyn ExecutionPlan>,
    /// Whether all of them run from the start, each in a thread.
    at_once: bool,
    properties: Arc<PlanProperties>,
}

impl InOrderExec {
    fn at_once(input: Arc<dyn ExecutionPlan>) -> Self {
        Self::new(input, true)
    }

    fn one_by_one(input: Arc<dyn ExecutionPlan>) -> Self {
        Self::new(input, false)
    }

    fn new(input: Arc<dyn ExecutionPlan>, at_once: bool) -> Self {
        let properties = PlanProperties::new(
            EquivalenceProperties::new(input.schema()),
            Partitioning::UnknownPartitioning(1),
            EmissionType::Both,
            Boundedness::Bounded,
        );
        Self {
            input,
            at_once,
            properties: Arc::new(properties),
        }
    }
}

impl DisplayAs for InOrderExec {
    fn fmt_as(&self, _: DisplayFormatType, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "InOrderExec")
    }
}

impl ExecutionPlan for InOrderExec {
    fn name(&self) -> &'static str {
        "InOrderExec"
    }

    fn properties(&self) -> &Arc<PlanProperties> {
        &self.properties
    }

    fn children(&self) -> Vec<&Arc<dyn ExecutionPlan>> {
        vec![&self.input]
    }

    fn apply_expressions(
        &self,
        _: &mut dyn FnMut(&Arc<dyn PhysicalExpr>) -> Result<TreeNodeRecursion>,
    ) -> Result<TreeNodeRecursion> {
        Ok(TreeNodeRecursion::Continue)
    }

    fn replace_children(
        self: Arc<Self>,
        mut children: Vec<Arc<dyn ExecutionPlan>>,
        _: ReplaceChildrenOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        Ok(Arc::new(Self::new(children.swap_remove(0), self.at_once)))
    }

    fn with_new_children(
        self: Arc<Self>,
        mut children: Vec<Arc<dyn ExecutionPlan>>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        Ok(Arc::new(Self::new(children.swap_remove(0), self.at_once)))
    }

    fn execute(&self, _: usize, context: Arc<TaskContext>) -> Result<SendableRecordBatchStream> {
        let schema = self.schema();
        let shares = self.input.output_partitioning().partition_count();
        if !self.at_once {
            let input = Arc::clone(&self.input);
            let batches = stream::iter(0..shares).flat_map(move |share| {
                match input.execute(share, Arc::clone(&context)) {
                    Ok(batches) => batches,
                    Err(e) => {
                        let failed = stream::iter([Err(e)]);
                        Box::pin(RecordBatchStreamAdapter::new(input.schema(), failed))
                    }
                }
            });
            return Ok(Box::pin(RecordBatchStreamAdapter::new(schema, batches)));
        }
        let shares = (0..shares)
            .map(|share| {
                let runtime = RuntimeEnvBuilder::from_runtime_env(&context.runtime_env())
                    .with_memory_pool(Arc::new(GreedyMemoryPool::new(MEMORY)))
                    .build_arc()?;
                let context = TaskContext::new(
                    context.task_id(),
                    context.session_id(),
                    context.session_config().clone(),
                    context.scalar_functions().clone(),
                    context.higher_order_functions().clone(),
                    context.aggregate_functions().clone(),
                    context.window_functions().clone(),
                    runtime,
                );
                self.input
                    .execute(share, Arc::new(context))
                    .map(in_a_thread)
            })
            .collect::<Result<Vec<_>>>()?;
        let batches = stream::iter(shares).flat_map(|share| {
            stream::unfold(Some(share), |share| async move {
                let mut share = share?;
                match share.recv().await {
                    Some(Ok(Some(batch))) => Some((Ok(batch), Some(share))),
                    Some(Ok(None)) => None,
                    Some(Err(e)) => Some((Err(e), None)),
                    None => {
                        let died = "a thread that aggregated has died".to_owned();
                        Some((Err(DataFusionError::Internal(died)), None))
                    }
                }
            })
        });
        Ok(Box::pin(RecordBatchStreamAdapter::new(schema, batches)))
    }
}

/// Runs a stream in a thread of its own; what comes last is `None`.
fn in_a_thread(
    mut stream: SendableRecordBatchStream,
) -> mpsc::Receiver<Result<Option<RecordBatch>>> {
    let (sender, receiver) = mpsc::channel(WAITING);
    let runtime = tokio::runtime::Handle::current();
    tokio::task::spawn_blocking(move || {
        runtime.block_on(async move {
            while let Some(batch) = stream.next().await {
                let failed = batch.is_err();
                if sender.send(batch.map(Some)).await.is_err() || failed {
                    return;
                }
            }
            // Nobody may be listening any more: then nobody wants to know.
            let _ = sender.send(Ok(None)).await;
        });
    });
    receiver
}
