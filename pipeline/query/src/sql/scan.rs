//! Reading a table's files: row group by row group, on all cores, given out in order.
//!
//! What one thread decodes waits until it is its turn, so that the rows come in the order of the files
//! whatever the number of threads, and sums over them have the same bits. Conditions are looked at where
//! the rows are decoded.

use crate::sql::table::file_fault;
use datafusion::arrow::array::cast::AsArray;
use datafusion::arrow::array::{
    Array, ArrayRef, PrimitiveArray, RecordBatch, RecordBatchOptions, StringViewArray,
};
use datafusion::arrow::buffer::{Buffer, ScalarBuffer};
use datafusion::arrow::compute::filter_record_batch;
use datafusion::arrow::datatypes::{DataType, Float64Type, SchemaRef};
use datafusion::common::stats::Precision;
use datafusion::common::tree_node::TreeNodeRecursion;
use datafusion::common::{DataFusionError, Result, Statistics};
use datafusion::execution::{SendableRecordBatchStream, TaskContext};
use datafusion::physical_expr::{EquivalenceProperties, PhysicalExpr};
use datafusion::physical_plan::execution_plan::{Boundedness, EmissionType, ReplaceChildrenOptions};
use datafusion::physical_plan::statistics::StatisticsArgs;
use datafusion::physical_plan::stream::RecordBatchStreamAdapter;
use datafusion::physical_plan::{
    DisplayAs, DisplayFormatType, ExecutionPlan, Partitioning, PlanProperties,
};
use futures_util::stream;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ParquetRecordBatchReaderBuilder};
use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
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
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) path: PathBuf,
    pub(crate) keys: Vec<String>,
    pub(crate) footer: ArrowReaderMetadata,
}

/// What is read of a table.
#[derive(Debug)]
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

    /// Starts to read a part in a thread of its own.
    fn start(self: &Arc<Self>, part: usize) -> Batches {
        let (sender, receiver) = mpsc::channel(AHEAD);
        let scan = Arc::clone(self);
        tokio::task::spawn_blocking(move || {
            let end = scan.read(part, &mut |batch| {
                sender.blocking_send(Ok(Some(batch))).is_ok()
            });
            // Nobody may be listening any more: then nobody wants to know.
            let _ = sender.blocking_send(end.map(|()| None));
        });
        receiver
    }

    /// Gives the batches of a part to `give`, until that has enough.
    fn read(&self, part: usize, give: &mut dyn FnMut(RecordBatch) -> bool) -> Result<()> {
        let (index, group) = self.parts[part];
        let opened = &self.files[index];
        let rows = self.rows(part);
        let keys: Vec<Repeated> = self
            .keys
            .iter()
            .map(|key| Repeated::new(&opened.keys[*key]))
            .collect();
        let mut finish = |decoded: Vec<ArrayRef>, n: usize| -> Result<bool> {
            let mut columns = decoded;
            columns.extend(keys.iter().map(|key| key.times(n)));
            let options = RecordBatchOptions::new().with_row_count(Some(n));
            let batch = RecordBatch::try_new_with_options(
                Arc::clone(&self.read_schema),
                columns,
                &options,
            )?;
            let batch = match &self.condition {
                None => batch,
                Some(condition) => {
                    let meets = condition.evaluate(&batch)?.into_array(n)?;
                    filter_record_batch(&batch, meets.as_boolean())?
                }
            };
            let n = batch.num_rows();
            let columns = self.output.iter().map(|i| Arc::clone(batch.column(*i)));
            let options = RecordBatchOptions::new().with_row_count(Some(n));
            let batch = RecordBatch::try_new_with_options(
                Arc::clone(&self.schema),
                columns.collect(),
                &options,
            )?;
            Ok(n == 0 || give(batch))
        };
        let size = (BATCH_BYTES * rows / self.bytes(part).max(1)).clamp(16, BATCH);
        if self.file_columns.is_empty() {
            let mut left = rows;
            while left > 0 {
                let n = left.min(size);
                if !finish(Vec::new(), n)? {
                    break;
                }
                left -= n;
            }
            return Ok(());
        }
        let fault = |e: &dyn fmt::Display| file_fault(&opened.path, e);
        let file = std::fs::File::open(&opened.path).map_err(|e| fault(&e))?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, opened.footer.clone());
        let wanted = self.file_columns.iter().copied();
        let columns = ProjectionMask::roots(builder.parquet_schema(), wanted);
        let reader = builder
            .with_projection(columns)
            .with_row_groups(vec![group])
            .with_batch_size(size)
            .build()
            .map_err(|e| fault(&e))?;
        let mut read = 0;
        for batch in reader {
            let batch = batch.map_err(|e| fault(&e))?;
            let n = batch.num_rows();
            read += n;
            let columns = batch.columns().iter().map(positive_zeros).collect();
            if !finish(columns, n)? {
                return Ok(());
            }
        }
        if read == rows {
            Ok(())
        } else {
            Err(fault(&format!("holds {read} of the {rows} rows that its footer speaks of")))
        }
    }
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
        let properties = PlanProperties::new(
            EquivalenceProperties::new(Arc::clone(&scan.schema)),
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
        match &self.scan.condition {
            Some(condition) => f(condition),
            None => Ok(TreeNodeRecursion::Continue),
        }
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
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let reading = Reading {
            scan: Arc::clone(&self.scan),
            ahead: if self.shares == 1 { threads.min(8) } else { 1 },
            parts: self.share(share),
            open: VecDeque::new(),
            left: self.scan.limit.unwrap_or(usize::MAX),
        };
        let schema = Arc::clone(&self.scan.schema);
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
