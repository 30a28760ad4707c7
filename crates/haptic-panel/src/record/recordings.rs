//! The recordings of the folder that the user looks at.

use super::Listed;
use std::path::{Path, PathBuf};

/// The list, as far as it is read.
#[derive(Debug, Default)]
pub(crate) struct Recordings {
    /// The folder that was asked for.
    folder: Option<PathBuf>,
    listed: Vec<Listed>,
    /// Those of the reading under way: the list before stays until it is over.
    fresh: Vec<Listed>,
    is_being_read: bool,
    /// A recording was made since.
    has_changed: bool,
    problem: Option<String>,
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

    /// A recording was made.
    pub(crate) fn note_change(&mut self) {
        self.has_changed = true;
    }

    /// Takes a recording of a folder.
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

    /// The reading of a folder is over.
    pub(crate) fn end(&mut self, folder: &Path, result: Result<(), String>) {
        if self.folder.as_deref() != Some(folder) {
            return;
        }
        self.is_being_read = false;
        // Files that are gone go, and the order is that of the folder.
        self.listed = std::mem::take(&mut self.fresh);
        self.problem = result.err();
    }

    /// Those that are read, the newest first.
    pub(crate) fn listed(&self) -> &[Listed] {
        &self.listed
    }

    /// Whether more may follow.
    pub(crate) fn is_being_read(&self) -> bool {
        self.is_being_read
    }

    /// Why the folder cannot be read.
    pub(crate) fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }
}
