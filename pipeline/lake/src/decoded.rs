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

#[cfg(test)]
mod tests {
    use super::*;

    /// Three items, of which the second is what `second` gives.
    fn read(second: fn() -> Result<u8, ParquetError>) -> Vec<Result<u8, String>> {
        let items = [|| Ok(1), second, || Ok(3)];
        until_damaged(items.into_iter().map(|item| item()))
            .map(|item| item.map_err(|e| e.to_string()))
            .collect()
    }

    #[test]
    fn a_panic_is_an_error_and_nothing_is_read_after_it() {
        assert_eq!(read(|| Ok(2)), [Ok(1), Ok(2), Ok(3)]);
        let panicked = read(|| panic!("offset out of bounds"));
        assert_eq!((panicked.len(), &panicked[0]), (2, &Ok(1)));
        assert!(panicked[1].as_ref().unwrap_err().contains("damaged"));
        let failed = read(|| Err(ParquetError::General("no page".into())));
        assert_eq!((failed.len(), &failed[0]), (2, &Ok(1)));
        assert!(failed[1].as_ref().unwrap_err().contains("no page"));
    }
}
