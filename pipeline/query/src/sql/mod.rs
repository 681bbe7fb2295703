//! SQL over Hive-partitioned Parquet tables, by DataFusion.
//!
//! A [`Table`] is a list of files and what their paths say of them. What is asked of it is planned by
//! DataFusion; the files are read by us: only those whose path can meet the condition, in order, on all
//! cores, so that the rows come in one order whatever the number of threads. Where SQL leaves a choice, the
//! answer is DuckDB's: another reader of the same files gives the same rows.

mod answer;
mod dialect;
mod fault;
mod format;
mod joins;
mod meaning;
mod partial;
mod pruning;
mod scan;
mod session;
mod statement;
mod table;

pub use answer::{Answer, Value};
pub use fault::Fault;
pub use format::{Format, aligned};
pub use session::{print, run};
pub use table::{File, Table};
