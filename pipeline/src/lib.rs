//! Files, clocks and tables around the mathematics: experiments in, a lake of results out.
//!
//! simulate → estimate → reduce → score, each stage addressed by its input and its code in a store
//! ([`store`]), published as Parquet tables and MCAP traces ([`lake`]), and compared with what the
//! papers print ([`stage`]).

pub mod bad_input;
pub mod campaign;
pub mod cli;
mod decoded;
pub mod engine;
pub mod error;
pub mod experiment;
pub mod judged;
mod kept;
pub mod lake;
pub mod ledger;
pub mod long_campaign;
pub mod numbers;
pub mod papers;
pub mod progress;
pub mod published;
pub mod query;
pub mod recorded;
pub mod report;
pub mod rows;
pub mod stage;
pub mod statistics;
pub mod store;
pub mod svg;
pub mod table;
pub mod tables;
pub mod trace;
pub mod tracking;
pub mod verdict;

pub use error::Error;
