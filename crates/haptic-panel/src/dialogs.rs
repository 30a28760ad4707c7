//! The desktop's own dialogs for files, through its portal (`org.freedesktop.portal.FileChooser`).
//!
//! A dialog is a window of another process, and keeps the thread that opens it waiting for as long as it is open. It is
//! given no parent: the portal makes a dialog with a parent modal, and some desktops then keep every key from the
//! parent, those of Stop among them.

#[cfg(test)]
mod tests;

use crate::intent::{DialogPurpose, Intent};
use egui::Ui;
use rfd::FileDialog;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Once;

/// Opens a dialog near a file or folder and waits until it is closed. `None` if nothing was chosen.
///
/// # Errors
/// Why there is no dialog.
pub(crate) fn ask(purpose: DialogPurpose, near: &Path) -> Result<Option<PathBuf>, String> {
    if !has_session_bus() {
        return Err("this session has no message bus, through which dialogs for files are opened".to_owned());
    }
    let folder = near
        .ancestors()
        .find(|folder| folder.is_dir())
        .unwrap_or(Path::new("/"));
    let dialog = FileDialog::new().set_title(purpose.title()).set_directory(folder);
    let (chosen, complaints) = Complaints::during(|| match purpose {
        DialogPurpose::Recording => dialog
            .add_filter("Recordings", &["mcap", "csv", "parquet"])
            .add_filter("All files", &["*"])
            .pick_file(),
        DialogPurpose::FileToIdentify | DialogPurpose::StudyPlan => dialog.pick_file(),
        DialogPurpose::Folder | DialogPurpose::StudyFolder => dialog.pick_folder(),
        DialogPurpose::Export(format) => {
            let extension = format.extension();
            dialog
                .set_file_name(format!("haptic-plot.{extension}"))
                .add_filter(extension.to_uppercase(), &[extension])
                .save_file()
        }
    });
    if chosen.is_none() && !complaints.is_empty() {
        return Err(format!("no dialog for files can be opened: {}", complaints.join("; ")));
    }
    Ok(chosen)
}

/// Whether there is a session's bus to look for. Without one libdbus would start one.
fn has_session_bus() -> bool {
    let is_set = std::env::var_os("DBUS_SESSION_BUS_ADDRESS").is_some_and(|address| !address.is_empty());
    let of_user = std::env::var_os("XDG_RUNTIME_DIR").map(|folder| PathBuf::from(folder).join("bus"));
    is_set || of_user.is_some_and(|socket| socket.exists())
}

/// What the library of the dialogs complains of. Its log alone distinguishes a dialog that was closed from one that
/// could not be opened.
struct Complaints;

thread_local! {
    /// Those of this thread, while one waits for a dialog.
    static COMPLAINTS: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

impl Complaints {
    /// Does something, and returns what was complained of meanwhile.
    fn during<T>(work: impl FnOnce() -> T) -> (T, Vec<String>) {
        static INSTALLED: Once = Once::new();
        // Another logger would hear them in its place: then a dialog that fails looks like one that was closed.
        INSTALLED.call_once(|| log::set_logger(&Self).map_or((), |()| log::set_max_level(log::LevelFilter::Error)));
        COMPLAINTS.set(Some(Vec::new()));
        let done = work();
        (done, COMPLAINTS.take().unwrap_or_default())
    }
}

impl log::Log for Complaints {
    fn enabled(&self, about: &log::Metadata<'_>) -> bool {
        about.target().starts_with("rfd")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            COMPLAINTS.with_borrow_mut(|kept| kept.iter_mut().for_each(|kept| kept.push(record.args().to_string())));
        }
    }

    fn flush(&self) {}
}

/// Width of the browse button with the distance before it, points.
pub(crate) const BROWSE_WIDTH: f32 = 82.0;

/// Shows the button beside a field for a path. Returns whether it was pressed.
pub(crate) fn browse_button(
    ui: &mut Ui,
    text: &str,
    name: &str,
    (purpose, near): (DialogPurpose, &str),
    intents: &mut Vec<Intent>,
) -> bool {
    let button = ui
        .button(text)
        .on_hover_text("Opens the dialog of the desktop. Space and Escape stop in this window, not in that one.")
        .accessible_name(name);
    if button.clicked() {
        let near = PathBuf::from(near);
        intents.push(Intent::Choose { purpose, near });
    }
    button.clicked()
}
