//! Reading a table's files: row group by row group, on all cores, given out in order.
//!
//! What one thread decodes waits until it is its turn, so that the rows come in the order of the files
//! whatever the number of threads, and sums over them have the same bits. Conditions are looked at where
//! the rows are decoded.

use crate::sql::pruning::{self, Later};
use crate::sql::table::file_fault;
use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{
    Array, ArrayRef, PrimitiveArray, RecordBatch, RecordBatchOptions, StringViewArray,
};
use datafusion::arrow::buffer::{Buffer, ScalarBuffer};
use datafusion::arrow::compute::{SortOptions, filter_record_batch};
use datafusion::arrow::datatypes::{DataType, Float64Type, SchemaRef};
use datafusion::common::config::ConfigOptions;
use datafusion::common::stats::Precision;
use datafusion::common::tree_node::TreeNodeRecursion;
use datafusion::common::{DataFusionError, Result, Statistics};
use datafusion::execution::{SendableRecordBatchStream, TaskContext};
use datafusion::physical_expr::expressions::Column;
use datafusion::physical_expr::{
    DynamicFilterTracking, EquivalenceProperties, PhysicalExpr, PhysicalSortExpr,
};
use datafusion::physical_plan::execution_plan::{
    Boundedness, EmissionType, ReplaceChildrenOptions, apply_expression_roots,
};
use datafusion::physical_plan::filter_pushdown::{
    ChildPushdownResult, FilterPushdownPhase, FilterPushdownPropagation, PushedDown,
};
use datafusion::physical_plan::sort_pushdown::SortOrderPushdownResult;
use datafusion::physical_plan::statistics::StatisticsArgs;
use datafusion::physical_plan::stream::RecordBatchStreamAdapter;
use datafusion::physical_plan::{
    DisplayAs, DisplayFormatType, ExecutionPlan, Partitioning, PlanProperties,
};
use futures_util::stream;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};
use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;
use tokio::sync::mpsc;

/// The most rows in a batch.
pub(crate) const BATCH: usize = 8192;
/// The bytes of a batch that are aimed at: rows with long lists come in smaller batches.
const BATCH_BYTES: usize = 1 << 20;
/// Batches that a thread is ahead of the reader.
const AHEAD: usize = 16;
/// Of rows under a condition, what is taken to meet it when joins are planned: one in this many.
const MEET: usize = 5;

/// A file with its footer.
#[derive(Clone, Debug)]
pub(crate) struct Opened {
    pub(crate) path: PathBuf,
    pub(crate) keys: Vec<String>,
    pub(crate) footer: ArrowReaderMetadata,
    pub(crate) stamp: Stamp,
}

/// What is read of a table.
#[derive(Clone, Debug)]
pub(crate) struct Scan {
    pub(crate) table: String,
    /// The columns that are decoded, by their place in the files.
    pub(crate) file_columns: Vec<usize>,
    /// The keys that are added, by their place among the keys.
    pub(crate) keys: Vec<usize>,
    /// The schema of both.
    pub(crate) read_schema: SchemaRef,
    /// The condition, over `read_schema`.
    pub(crate) condition: Option<Arc<dyn PhysicalExpr>>,
    /// The columns that are given, by their place in `read_schema`.
    pub(crate) output: Vec<usize>,
    /// The schema of what is given.
    pub(crate) schema: SchemaRef,
    pub(crate) files: Vec<Opened>,
    /// File and row group, in order.
    pub(crate) parts: Vec<(usize, usize)>,
    pub(crate) limit: Option<usize>,
    /// The columns that the rows are sorted by, by their place in what is given.
    pub(crate) order: Vec<usize>,
    /// Conditions over what is given that become narrower while the plan runs.
    pub(crate) later: Vec<Later>,
}

/// One row group's batches, the last one `None`: without it the thread has died.
type Batches = mpsc::Receiver<Result<Option<RecordBatch>>>;

impl Scan {
    fn rows(&self, part: usize) -> usize {
        let (file, group) = self.parts[part];
        let groups = self.files[file].footer.metadata().row_groups();
        usize::try_from(groups[group].num_rows()).unwrap_or(0)
    }

    /// Bytes of one row group's columns that are read, as they lie in memory (about).
    fn bytes(&self, part: usize) -> usize {
        let (file, group) = self.parts[part];
        let footer = &self.files[file].footer;
        let columns = footer.metadata().row_group(group).columns();
        let roots = |i: usize| footer.parquet_schema().get_column_root_idx(i);
        let read = (0..columns.len()).filter(|i| self.file_columns.contains(&roots(*i)));
        let values: i64 = read.map(|i| columns[i].num_values()).sum();
        usize::try_from(values).unwrap_or(0) * 16 + self.rows(part) * 16 * self.keys.len()
    }

    /// False if no row of the part can meet the conditions as they are by now.
    fn may_matter(&self, part: usize) -> bool {
        let (file, group) = self.parts[part];
        let footer = &self.files[file].footer;
        self.later
            .iter()
            .all(|later| later.may_meet(&self.schema, footer, group))
    }

    /// Starts to read a part in a thread of its own.
    fn start(self: &Arc<Self>, part: usize) -> Batches {
        let (sender, receiver) = mpsc::channel(AHEAD);
        let scan = Arc::clone(self);
        tokio::task::spawn_blocking(move || {
            let mut part = match Part::open(scan, part) {
                Ok(part) => part,
                Err(e) => {
                    // Nobody may be listening any more: then nobody wants to know.
                    let _ = sender.blocking_send(Err(e));
                    return;
                }
            };
            loop {
                let batch = part.next();
                let last = !matches!(batch, Ok(Some(_)));
                if sender.blocking_send(batch).is_err() || last {
                    return;
                }
            }
        });
        receiver
    }
}

/// A row group that is being decoded.
struct Part {
    scan: Arc<Scan>,
    part: usize,
    /// None where no column of the file is asked for.
    reader: Option<ParquetRecordBatchReader>,
    keys: Vec<Repeated>,
    size: usize,
    left: usize,
}

impl Part {
    fn open(scan: Arc<Scan>, part: usize) -> Result<Self> {
        let (file, group) = scan.parts[part];
        let opened = &scan.files[file];
        let rows = scan.rows(part);
        if !scan.may_matter(part) {
            return Ok(Self {
                part,
                reader: None,
                keys: Vec::new(),
                size: BATCH,
                left: 0,
                scan: Arc::clone(&scan),
            });
        }
        let size = (BATCH_BYTES * rows / scan.bytes(part).max(1)).clamp(16, BATCH);
        let fault = |e: &dyn fmt::Display| file_fault(&opened.path, e);
        let reader = if scan.file_columns.is_empty() {
            None
        } else {
            let file = std::fs::File::open(&opened.path).map_err(|e| fault(&e))?;
            if stamp(&file).map_err(|e| fault(&e))? != opened.stamp {
                return Err(fault(&"was written anew while it was read; ask again"));
            }
            let builder =
                ParquetRecordBatchReaderBuilder::new_with_metadata(file, opened.footer.clone());
            let wanted = scan.file_columns.iter().copied();
            let columns = ProjectionMask::roots(builder.parquet_schema(), wanted);
            let reader = builder
                .with_projection(columns)
                .with_row_groups(vec![group])
                .with_batch_size(size)
                .build()
                .map_err(|e| fault(&e))?;
            Some(reader)
        };
        let keys = scan
            .keys
            .iter()
            .map(|key| Repeated::new(&opened.keys[*key]));
        Ok(Self {
            part,
            reader,
            keys: keys.collect(),
            size,
            left: rows,
            scan: Arc::clone(&scan),
        })
    }

    fn fault(&self, e: impl ToString) -> DataFusionError {
        let (file, _) = self.scan.parts[self.part];
        file_fault(&self.scan.files[file].path, e)
    }

    /// The next batch of rows that meet the condition.
    fn next(&mut self) -> Result<Option<RecordBatch>> {
        while self.left > 0 {
            let decoded = match &mut self.reader {
                None => Vec::new(),
                Some(reader) => match reader.next() {
                    Some(Ok(batch)) => batch.columns().iter().map(positive_zeros).collect(),
                    Some(Err(e)) => return Err(self.fault(e)),
                    None => {
                        let message = "holds fewer rows than its footer speaks of";
                        return Err(self.fault(message));
                    }
                },
            };
            let n = decoded
                .first()
                .map_or(self.left.min(self.size), |c: &ArrayRef| c.len());
            self.left = self.left.saturating_sub(n);
            let batch = self.finish(decoded, n)?;
            if batch.num_rows() > 0 {
                return Ok(Some(batch));
            }
        }
        Ok(None)
    }

    fn finish(&self, mut columns: Vec<ArrayRef>, n: usize) -> Result<RecordBatch> {
        let scan = &self.scan;
        columns.extend(self.keys.iter().map(|key| key.times(n)));
        let batch = |schema: &SchemaRef, columns, n| {
            let options = RecordBatchOptions::new().with_row_count(Some(n));
            RecordBatch::try_new_with_options(Arc::clone(schema), columns, &options)
        };
        let mut read = batch(&scan.read_schema, columns, n)?;
        if let Some(condition) = &scan.condition {
            let meets = condition.evaluate(&read)?.into_array(n)?;
            read = filter_record_batch(&read, meets.as_boolean())?;
        }
        let output = scan.output.iter().map(|i| Arc::clone(read.column(*i)));
        let mut given = batch(&scan.schema, output.collect(), read.num_rows())?;
        for later in &scan.later {
            let meets = later
                .condition
                .evaluate(&given)?
                .into_array(given.num_rows())?;
            given = filter_record_batch(&given, meets.as_boolean())?;
        }
        Ok(given)
    }
}

/// What changes when a file is written anew.
pub(crate) type Stamp = (u64, Option<SystemTime>);

pub(crate) fn stamp(file: &std::fs::File) -> std::io::Result<Stamp> {
    let metadata = file.metadata()?;
    Ok((metadata.len(), metadata.modified().ok()))
}

/// −0 as 0: comparisons and groups here tell them apart, SQL does not.
fn positive_zeros(array: &ArrayRef) -> ArrayRef {
    match array.data_type() {
        DataType::Float64 => {
            let floats = array.as_primitive::<Float64Type>();
            let sum: PrimitiveArray<Float64Type> = floats.unary(|x| x + 0.0);
            Arc::new(sum)
        }
        _ => Arc::clone(array),
    }
}

/// A text that stands in every row.
struct Repeated {
    view: u128,
    text: Buffer,
}

impl Repeated {
    fn new(text: &str) -> Self {
        Self {
            view: datafusion::arrow::array::make_view(text.as_bytes(), 0, 0),
            text: Buffer::from(text.as_bytes()),
        }
    }

    fn times(&self, n: usize) -> ArrayRef {
        let views = ScalarBuffer::from(vec![self.view; n]);
        Arc::new(StringViewArray::new(views, [self.text.clone()], None))
    }
}

/// The plan's leaf: `shares` streams, each of a run of row groups.
#[derive(Debug)]
pub(crate) struct ScanExec {
    scan: Arc<Scan>,
    shares: usize,
    properties: Arc<PlanProperties>,
}

impl ScanExec {
    pub(crate) fn new(scan: Arc<Scan>) -> Self {
        Self::shared(scan, 1)
    }

    fn shared(scan: Arc<Scan>, shares: usize) -> Self {
        let order = scan.order.iter().map(|i| {
            let column = Column::new(scan.schema.field(*i).name(), *i);
            let ascending = SortOptions::default().asc().nulls_last();
            PhysicalSortExpr::new(Arc::new(column), ascending)
        });
        let known = EquivalenceProperties::new_with_orderings(
            Arc::clone(&scan.schema),
            [order.collect::<Vec<_>>()],
        );
        let properties = PlanProperties::new(
            known,
            Partitioning::UnknownPartitioning(shares),
            EmissionType::Incremental,
            Boundedness::Bounded,
        );
        Self {
            scan,
            shares,
            properties: Arc::new(properties),
        }
    }

    /// The same rows in `shares` streams, which follow each other; None where a limit counts them.
    pub(crate) fn in_shares(&self, shares: usize) -> Option<Self> {
        (self.scan.limit.is_none() && self.shares == 1)
            .then(|| Self::shared(Arc::clone(&self.scan), shares))
    }

    /// How many keys its rows are sorted by.
    pub(crate) fn keys_in_order(&self) -> usize {
        self.scan.order.len().max(1)
    }

    /// The bytes of the largest file, as it lies in memory (about).
    pub(crate) fn largest_file(&self) -> usize {
        let mut bytes = vec![0; self.scan.files.len()];
        for (i, (file, _)) in self.scan.parts.iter().enumerate() {
            bytes[*file] += self.scan.bytes(i);
        }
        bytes.into_iter().max().unwrap_or(0)
    }

    /// How many rows are read.
    pub(crate) fn rows(&self) -> usize {
        (0..self.scan.parts.len()).map(|i| self.scan.rows(i)).sum()
    }

    /// The parts of one share: all shares have about as many rows, and a part is in one of them.
    fn share(&self, share: usize) -> std::ops::Range<usize> {
        let total = self.rows();
        let edge = |share: usize| {
            let mut before = 0;
            let rows = (0..self.scan.parts.len()).map(|i| self.scan.rows(i));
            rows.take_while(|rows| {
                let inside = before * self.shares < share * total;
                before += rows;
                inside
            })
            .count()
        };
        let end = if share + 1 == self.shares {
            self.scan.parts.len()
        } else {
            edge(share + 1)
        };
        edge(share)..end
    }
}

impl DisplayAs for ScanExec {
    fn fmt_as(&self, _: DisplayFormatType, f: &mut fmt::Formatter) -> fmt::Result {
        let scan = &self.scan;
        write!(
            f,
            "ScanExec: {}, files={}, row_groups={}",
            scan.table,
            scan.files.len(),
            scan.parts.len()
        )?;
        if let Some(condition) = &scan.condition {
            write!(f, ", condition={condition}")?;
        }
        for later in &scan.later {
            write!(f, ", later={}", later.condition)?;
        }
        if let Some(limit) = scan.limit {
            write!(f, ", limit={limit}")?;
        }
        Ok(())
    }
}

impl ExecutionPlan for ScanExec {
    fn name(&self) -> &'static str {
        "ScanExec"
    }

    fn properties(&self) -> &Arc<PlanProperties> {
        &self.properties
    }

    fn children(&self) -> Vec<&Arc<dyn ExecutionPlan>> {
        Vec::new()
    }

    fn apply_expressions(
        &self,
        f: &mut dyn FnMut(&Arc<dyn PhysicalExpr>) -> Result<TreeNodeRecursion>,
    ) -> Result<TreeNodeRecursion> {
        let later = self.scan.later.iter().map(|later| &later.condition);
        apply_expression_roots(self.scan.condition.iter().chain(later), f)
    }

    fn replace_children(
        self: Arc<Self>,
        _: Vec<Arc<dyn ExecutionPlan>>,
        _: ReplaceChildrenOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        Ok(self)
    }

    fn with_new_children(
        self: Arc<Self>,
        _: Vec<Arc<dyn ExecutionPlan>>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        Ok(self)
    }

    fn execute(&self, share: usize, _: Arc<TaskContext>) -> Result<SendableRecordBatchStream> {
        let schema = Arc::clone(&self.scan.schema);
        if self.shares > 1 {
            // A share has a thread of its own already.
            let batches = InPlace {
                scan: Arc::clone(&self.scan),
                parts: self.share(share),
                open: None,
            };
            let batches = stream::iter(batches);
            return Ok(Box::pin(RecordBatchStreamAdapter::new(schema, batches)));
        }
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let reading = Reading {
            scan: Arc::clone(&self.scan),
            ahead: threads.min(8),
            parts: self.share(share),
            open: VecDeque::new(),
            left: self.scan.limit.unwrap_or(usize::MAX),
        };
        let batches = stream::unfold(Some(reading), |reading| async move {
            let mut reading = reading?;
            match reading.next().await {
                Ok(None) => None,
                Ok(Some(batch)) => Some((Ok(batch), Some(reading))),
                Err(e) => Some((Err(e), None)),
            }
        });
        Ok(Box::pin(RecordBatchStreamAdapter::new(schema, batches)))
    }

    fn handle_child_pushdown_result(
        &self,
        phase: FilterPushdownPhase,
        asked: ChildPushdownResult,
        _: &ConfigOptions,
    ) -> Result<FilterPushdownPropagation<Arc<dyn ExecutionPlan>>> {
        let filters = asked.parent_filters.into_iter().map(|asked| asked.filter);
        let (later, other): (Vec<_>, Vec<_>) = filters
            .partition(|filter| DynamicFilterTracking::classify(filter).contains_dynamic_filter());
        let said = vec![PushedDown::No; later.len() + other.len()];
        let said = FilterPushdownPropagation::with_parent_pushdown_result(said);
        if phase != FilterPushdownPhase::Post || later.is_empty() {
            return Ok(said);
        }
        let scan = Scan {
            later: [
                self.scan.later.clone(),
                later.into_iter().map(Later::new).collect(),
            ]
            .concat(),
            ..self.scan.as_ref().clone()
        };
        let scan = Self::shared(Arc::new(scan), self.shares);
        Ok(said.with_updated_node(Arc::new(scan)))
    }

    /// Row groups in the order of what they have at best, for whoever wants the first rows of `order`.
    fn try_pushdown_sort(
        &self,
        order: &[PhysicalSortExpr],
    ) -> Result<SortOrderPushdownResult<Arc<dyn ExecutionPlan>>> {
        let unsupported = Ok(SortOrderPushdownResult::Unsupported);
        let Some(first) = order.first() else {
            return unsupported;
        };
        let Some(column) = first.expr.downcast_ref::<Column>() else {
            return unsupported;
        };
        if self.scan.limit.is_some() || self.shares > 1 {
            return unsupported;
        }
        let best = pruning::best(column.name(), first.options.descending, &self.scan.files);
        let Some(best) = best else {
            return unsupported;
        };
        let mut parts = self.scan.parts.clone();
        let rank = |(file, group): &(usize, usize)| best[*file][*group];
        // Row groups without a value come last.
        parts.sort_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            let order = a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal);
            let order = if first.options.descending {
                order.reverse()
            } else {
                order
            };
            a.is_none().cmp(&b.is_none()).then(order)
        });
        let scan = Scan {
            parts,
            order: Vec::new(),
            ..self.scan.as_ref().clone()
        };
        Ok(SortOrderPushdownResult::Inexact {
            inner: Arc::new(Self::new(Arc::new(scan))),
        })
    }

    fn statistics_from_inputs(
        &self,
        _: &[Arc<Statistics>],
        args: &StatisticsArgs,
    ) -> Result<Arc<Statistics>> {
        let mut parts = match args.partition() {
            Some(share) => self.share(share),
            None => 0..self.scan.parts.len(),
        };
        let limit = self.scan.limit.unwrap_or(usize::MAX);
        let rows: usize = parts.clone().map(|i| self.scan.rows(i)).sum();
        let width = parts
            .next()
            .map_or(0, |i| self.scan.bytes(i) / self.scan.rows(i).max(1));
        let (rows, bytes) = if self.scan.condition.is_some() {
            let met = rows.div_ceil(MEET).min(limit);
            (Precision::Inexact(met), met * width)
        } else {
            let met = rows.min(limit);
            (Precision::Exact(met), met * width)
        };
        let unknown = Statistics::new_unknown(&self.scan.schema);
        let known = unknown
            .with_num_rows(rows)
            .with_total_byte_size(Precision::Inexact(bytes));
        Ok(Arc::new(known))
    }
}

/// Batches that are decoded where they are asked for.
struct InPlace {
    scan: Arc<Scan>,
    parts: std::ops::Range<usize>,
    open: Option<Part>,
}

impl InPlace {
    fn step(&mut self) -> Result<Option<RecordBatch>> {
        loop {
            if let Some(part) = &mut self.open {
                if let Some(batch) = part.next()? {
                    return Ok(Some(batch));
                }
                self.open = None;
            }
            match self.parts.next() {
                Some(part) => self.open = Some(Part::open(Arc::clone(&self.scan), part)?),
                None => return Ok(None),
            }
        }
    }
}

impl Iterator for InPlace {
    type Item = Result<RecordBatch>;

    fn next(&mut self) -> Option<Self::Item> {
        self.step().transpose()
    }
}

/// A stream of batches under way.
struct Reading {
    scan: Arc<Scan>,
    /// Parts that are read beside the one that is given.
    ahead: usize,
    parts: std::ops::Range<usize>,
    open: VecDeque<Batches>,
    /// Rows that may still be given.
    left: usize,
}

impl Reading {
    async fn next(&mut self) -> Result<Option<RecordBatch>> {
        while self.left > 0 {
            while self.open.len() <= self.ahead
                && let Some(part) = self.parts.next()
            {
                self.open.push_back(self.scan.start(part));
            }
            let Some(first) = self.open.front_mut() else {
                break;
            };
            match first.recv().await {
                Some(Ok(Some(batch))) => {
                    let n = batch.num_rows().min(self.left);
                    self.left -= n;
                    return Ok(Some(batch.slice(0, n)));
                }
                Some(Ok(None)) => {
                    self.open.pop_front();
                }
                Some(Err(e)) => return Err(e),
                None => {
                    return Err(DataFusionError::Internal(
                        "a thread that read a file has died".to_owned(),
                    ));
                }
            }
        }
        Ok(None)
    }
}
