//! Damaged Parquet files, of which the decoder may panic where it should fail.

use parquet::errors::ParquetError;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What `decode` gives, an error where it panics. What it was decoding with must not be used again.
pub fn unless_damaged<T>(
    decode: impl FnOnce() -> Result<T, ParquetError>,
) -> Result<T, ParquetError> {
    let damaged = |_| ParquetError::General("the file is damaged: its decoder gave up".into());
    catch_unwind(AssertUnwindSafe(decode)).map_err(damaged)?
}

/// The items of `reader` up to its end, its first error or its first panic.
pub fn until_damaged<T, E: Into<ParquetError>>(
    mut reader: impl Iterator<Item = Result<T, E>>,
) -> impl Iterator<Item = Result<T, ParquetError>> {
    let mut going = true;
    std::iter::from_fn(move || {
        let next = going.then(|| unless_damaged(|| reader.next().transpose().map_err(Into::into)));
        going = matches!(next, Some(Ok(Some(_))));
        next?.transpose()
    })
}
