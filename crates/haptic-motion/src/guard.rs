//! Keeps a damaged Parquet file from harm: the library trusts the sizes that a file names.

use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs the library. It panics on some damaged files; that is an error here.
///
/// # Errors
/// The library's own, as text, or its panic's.
pub fn guarded<T>(run: impl FnOnce() -> Result<T>) -> std::result::Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => result.map_err(|error| with_advice(error.to_string())),
        Err(panic) => {
            let message = panic.downcast_ref::<String>().map(String::as_str);
            let message = message.or(panic.downcast_ref::<&str>().copied()).unwrap_or_default();
            Err(format!("the file is damaged: {message}"))
        }
    }
}

/// What the library says, and what to do about a compression that it was built without.
fn with_advice(message: String) -> String {
    match message.split_once("Disabled feature at compile time: ") {
        Some((_, codec)) => format!(
            "it is compressed by {codec}, which is not read here: write it with snappy, gzip, lz4 or without \
             compression, as by `python3 -c 'import pandas; pandas.read_parquet(\"IN\").to_parquet(\"OUT\")'`"
        ),
        None => message,
    }
}

/// Pages of a column, of which none names more values than it can hold.
pub struct Pages {
    /// The library's own.
    pub inner: Box<dyn PageReader>,
    /// Values of the column.
    pub values: u64,
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let page = self.inner.get_next_page()?;
        if let Some(page) = &page {
            let most = if page.is_data_page() {
                self.values
            } else {
                page.buffer().len() as u64
            };
            let values = page.num_values();
            if u64::from(values) > most {
                return Err(ParquetError::General(format!(
                    "a page of {values} values where {most} are possible"
                )));
            }
        }
        Ok(page)
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.inner.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.inner.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool> {
        self.inner.at_record_boundary()
    }
}

impl Iterator for Pages {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}
