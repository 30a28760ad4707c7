//! The recordings of the folder that the user looks at.

use super::Listed;
use std::path::{Path, PathBuf};

/// The list, as far as it is read.
#[derive(Debug, Default)]
pub(crate) struct Recordings {
    /// The folder that was asked for.
    folder: Option<PathBuf>,
    pub(super) listed: Vec<Listed>,
    /// Those of the reading under way: the list before stays until it is over.
    fresh: Vec<Listed>,
    pub(super) is_being_read: bool,
    /// A recording was made since.
    has_changed: bool,
    /// Why the folder cannot be read.
    pub(super) problem: Option<String>,
}

impl Recordings {
    /// Whether the list is not that of a folder, or a recording was made there since.
    pub(crate) fn is_outdated(&self, folder: &str) -> bool {
        self.has_changed || self.folder.as_deref() != Some(Path::new(folder))
    }

    /// Asks for a folder. Returns what is known of it.
    pub(crate) fn ask(&mut self, folder: &Path) -> Vec<Listed> {
        if self.folder.as_deref() != Some(folder) {
            self.listed.clear();
        }
        self.folder = Some(folder.to_path_buf());
        self.fresh.clear();
        (self.is_being_read, self.has_changed) = (true, false);
        self.listed.clone()
    }

    pub(crate) fn note_change(&mut self) {
        self.has_changed = true;
    }

    pub(crate) fn take(&mut self, folder: &Path, listed: &Listed) {
        if self.folder.as_deref() != Some(folder) {
            return;
        }
        for list in [&mut self.listed, &mut self.fresh] {
            match list.iter_mut().find(|known| known.path == listed.path) {
                Some(known) => *known = listed.clone(),
                None => list.push(listed.clone()),
            }
        }
    }

    pub(crate) fn end(&mut self, folder: &Path, result: Result<(), String>) {
        if self.folder.as_deref() != Some(folder) {
            return;
        }
        self.is_being_read = false;
        // Files that are gone go, and the order is that of the folder.
        self.listed = std::mem::take(&mut self.fresh);
        self.problem = result.err();
    }
}
