//! SQL over a lake, and the papers' tables. Nothing else in the pipeline needs DataFusion or polars.

pub mod query;
pub mod sql;
pub mod tables;
