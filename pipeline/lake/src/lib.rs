//! What lies on disk: the rows of every table and their Parquet files, the store of results, the lake and its manifest.
//!
//! Knows no mathematics and nothing of experiments. Every other crate of the pipeline stands on this one.

pub mod bad_input;
pub mod causes;
pub mod decoded;
pub mod digits;
pub mod error;
pub mod kept;
pub mod lake;
pub mod numbers;
pub mod rows;
pub mod store;
pub mod table;

pub use error::Error;
