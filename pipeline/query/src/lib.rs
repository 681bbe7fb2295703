//! SQL over a lake, and the papers' tables. Nothing else in the pipeline needs polars.

pub mod query;
pub mod tables;
