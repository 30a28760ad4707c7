//! Keeps a damaged Parquet file from harm: the library trusts the sizes that a file names.

use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs the library. It panics on some damaged files; that is an error here.
pub(crate) fn guarded<T>(run: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_owned())))
}

/// Pages of a column, of which none names more values than it can hold.
pub(crate) struct Pages {
    pub(crate) inner: Box<dyn PageReader>,
    /// Values of the column.
    pub(crate) values: u64,
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let page = self.inner.get_next_page()?;
        if let Some(page) = &page {
            let possible = if page.is_data_page() {
                self.values
            } else {
                page.buffer().len() as u64
            };
            if u64::from(page.num_values()) > possible {
                let found = page.num_values();
                return Err(ParquetError::General(format!(
                    "a page names {found} values where {possible} are possible"
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
