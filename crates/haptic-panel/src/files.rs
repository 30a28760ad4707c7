//! Reads and writes files, each on a thread of its own: neither a stalled disk nor an hour of samples keeps
//! the window waiting.

use crate::dialogs;
use crate::export::{self, Destination, Picture, RowsInSight};
use crate::identify::Question;
use crate::intent::{DialogPurpose, Format};
use crate::model::Model;
use crate::record::{self, Listed, Loaded, WhatIfTape};
use crate::update::Update;
use crate::update_sender::UpdateSender;
use egui::{ColorImage, Rect};
use haptic_core::scene::SceneFile;
use haptic_lab::identify::record_file;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write as _};
use std::ops::ControlFlow;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

/// Most files at once: each may wait for its disk for ever.
const MAX_AT_ONCE: usize = 4;

/// Progress of an identification after which it is reported again: a point of the bar.
const SHARE_STEP: f64 = 0.01;

/// These threads give way to the window and to the daemon.
const NICENESS: i32 = 10;

/// Files that are being read or written.
#[derive(Debug)]
pub struct Files {
    updates: mpsc::Receiver<Update>,
    writer: Writer,
    /// Ends the rendering that is under way.
    what_if_is_over: Arc<AtomicBool>,
    /// Ends the listing that is under way.
    list_is_over: Arc<AtomicBool>,
    /// Ends the identification that is under way.
    identify_is_over: Arc<AtomicBool>,
}

#[derive(Clone, Debug)]
pub(crate) struct Writer {
    sender: UpdateSender,
    busy: Arc<AtomicUsize>,
}

impl Files {
    /// Files that call `repaint` from other threads when there is news to draw.
    #[must_use]
    pub fn new(repaint: impl Fn(Duration) + Send + Sync + 'static) -> Self {
        let (sender, updates) = UpdateSender::new(repaint);
        let busy = Arc::default();
        Self {
            updates,
            writer: Writer { sender, busy },
            what_if_is_over: Arc::default(),
            list_is_over: Arc::default(),
            identify_is_over: Arc::default(),
        }
    }

    /// The news since last time, without waiting.
    pub fn updates(&self) -> impl Iterator<Item = Update> + '_ {
        self.updates.try_iter()
    }

    /// Files that are being read or written.
    #[must_use]
    pub fn busy(&self) -> usize {
        self.writer.busy.load(Ordering::Acquire)
    }

    /// Reads a recording.
    pub fn open(&self, path: PathBuf) {
        let writer = self.writer.clone();
        self.writer.work_unnoticed(move || writer.read(path));
    }

    /// Asks for a file or a folder in a dialog of the desktop. A recording that is chosen is read.
    pub fn choose(&self, purpose: DialogPurpose, near: PathBuf) {
        let writer = self.writer.clone();
        self.writer
            .work_unnoticed(move || match (dialogs::ask(purpose, &near), purpose) {
                (Ok(Some(path)), DialogPurpose::Recording) => writer.read(path),
                (chosen, _) => Update::DialogClosed(chosen.map(|path| path.map(|path| (purpose, path)))),
            });
    }

    /// Lists the recordings of a folder, in place of the listing before. What is known is not read again.
    pub fn list(&mut self, folder: PathBuf, known: Vec<Listed>) {
        self.list_is_over.store(true, Ordering::Release);
        let is_over = Arc::new(AtomicBool::new(false));
        self.list_is_over = Arc::clone(&is_over);
        let sender = self.writer.sender.clone();
        self.writer.work_unnoticed(move || {
            let result = record::list(&folder, &known, &is_over, |listed| {
                let (folder, listed) = (folder.clone(), Box::new(listed));
                sender.send(Update::Listed { folder, listed }).unwrap_or_default();
            });
            Update::ListRead { folder, result }
        });
    }

    /// Renders another scene, or those of the recording, along the motion of a recording's file, in place of the
    /// rendering before.
    pub fn what_if(&mut self, number: u64, path: PathBuf, scene: Option<SceneFile>) {
        self.cancel_what_if();
        let is_over = Arc::new(AtomicBool::new(false));
        self.what_if_is_over = Arc::clone(&is_over);
        let name = scene.as_ref().map_or("its own scenes", |scene| &scene.name);
        let what = format!("Rendering {name} along {}", path.display());
        let writer = self.writer.clone();
        self.writer.work_unnoticed(move || {
            writer.report(Update::Busy(what));
            let result = WhatIfTape::render(&path, scene, &is_over).map(Box::new);
            Update::WhatIf { number, result }
        });
    }

    /// Gives the rendering up; its thread ends within a moment.
    pub fn cancel_what_if(&self) {
        self.what_if_is_over.store(true, Ordering::Release);
    }

    /// Reads the names of a file's columns.
    pub fn read_headings(&self, path: PathBuf) {
        self.writer.work_unnoticed(move || {
            let result = record_file::headings(&path).map_err(|error| error.to_string());
            Update::Headings { path, result }
        });
    }

    /// Identifies mass and friction, in place of the identification before.
    pub fn identify(&mut self, number: u64, question: Question) {
        self.cancel_identify();
        let is_over = Arc::new(AtomicBool::new(false));
        self.identify_is_over = Arc::clone(&is_over);
        let sender = self.writer.sender.clone();
        self.writer.work_unnoticed(move || {
            let mut reported = f64::NEG_INFINITY;
            let mut progress = |share: f64| {
                if is_over.load(Ordering::Acquire) {
                    return ControlFlow::Break(());
                }
                if share - reported >= SHARE_STEP {
                    reported = share;
                    sender.send(Update::Identifying { number, share }).unwrap_or_default();
                }
                ControlFlow::Continue(())
            };
            let result = question.answer(&mut progress).map(Box::new);
            Update::Identified { number, result }
        });
    }

    /// Gives the identification up.
    pub fn cancel_identify(&self) {
        self.identify_is_over.store(true, Ordering::Release);
    }

    /// Writes the plots in sight as CSV or SVG.
    pub fn export(&self, model: &Model, format: Format, to: Destination) {
        if format == Format::Svg {
            let picture = Picture::seen(model);
            let write = move |file: &mut File| file.write_all(picture.svg().as_bytes());
            return self.writer.export(format, to, write);
        }
        let rows = RowsInSight::seen(model);
        self.writer.export(format, to, move |file| {
            let mut out = BufWriter::with_capacity(1 << 18, file);
            rows.write(&mut out)?;
            out.flush()
        });
    }

    /// A handle for later exports.
    pub(crate) fn writer(&self) -> Writer {
        self.writer.clone()
    }
}

impl Writer {
    pub(crate) fn export_picture(&self, image: Arc<ColorImage>, part: Rect, scale: f32, to: Destination) {
        self.export(Format::Png, to, move |file| {
            let content = export::png(&image, part, scale).map_err(io::Error::other)?;
            file.write_all(&content)
        });
    }

    /// Writes an export into the file that its destination names.
    fn export(
        &self,
        format: Format,
        to: Destination,
        write: impl FnOnce(&mut File) -> io::Result<()> + Send + 'static,
    ) {
        let writer = self.clone();
        let kind = format.extension().to_uppercase();
        self.work_unnoticed(move || {
            let written = match &to {
                Destination::NewIn(folder) => {
                    writer.report(Update::Busy(format!("Writing {kind} into {}", folder.display())));
                    export::write_new(folder, format, write)
                }
                Destination::Asked { near } => match dialogs::ask(DialogPurpose::Export(format), near) {
                    Ok(Some(path)) => {
                        writer.report(Update::Busy(format!("Writing {}", path.display())));
                        export::replace(path, write)
                    }
                    Ok(None) => return Update::DialogClosed(Ok(None)),
                    Err(why) => return Update::DialogClosed(Err(why)),
                },
            };
            Update::Exported(written)
        });
    }

    /// Reads a recording, and reports how far it is.
    fn read(&self, path: PathBuf) -> Update {
        let progress = |share: Option<f64>| {
            let path = path.clone();
            self.report(Update::Reading { path, share });
        };
        progress(None);
        let result = Loaded::read(&path, progress).map(Box::new);
        Update::Opened { path, result }
    }

    /// Works on a thread of its own.
    pub(crate) fn work_unnoticed(&self, work: impl FnOnce() -> Update + Send + 'static) {
        if self.busy.fetch_add(1, Ordering::AcqRel) >= MAX_AT_ONCE {
            self.busy.fetch_sub(1, Ordering::AcqRel);
            let why = format!("{MAX_AT_ONCE} files are being read or written already; their disk may not answer");
            self.report(Update::Exported(Err(why)));
            return;
        }
        let (sender, place) = (self.sender.clone(), QueuePlace(Arc::clone(&self.busy)));
        let works = move || {
            // Of this thread alone. If that is refused, the work is done all the same.
            rustix::process::setpriority_process(None, NICENESS).unwrap_or_default();
            let update = work();
            drop(place);
            // It fails only if the window is closed.
            sender.send(update).unwrap_or_default();
        };
        if let Err(error) = thread::Builder::new().name("file".to_owned()).spawn(works) {
            self.report(Update::Exported(Err(format!("no thread to work with: {error}"))));
        }
    }

    fn report(&self, update: Update) {
        self.sender.send(update).unwrap_or_default();
    }
}

/// A place among the files at once, returned however the work ends.
#[derive(Debug)]
struct QueuePlace(Arc<AtomicUsize>);

impl Drop for QueuePlace {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Most files of one kind in a folder.
const MAX_FILES: u32 = 9999;

/// Creates a file in `folder` under a new name. If `folder` is a named pipe, the pipe itself is opened,
/// for a program at its other end; that waits until there is one.
///
/// # Errors
/// Why it could not be created, with the name of the folder or the file.
pub(crate) fn create(folder: &Path, name: &str, extension: &str) -> Result<(PathBuf, File), String> {
    if folder.metadata().is_ok_and(|found| found.file_type().is_fifo()) {
        let pipe = OpenOptions::new().write(true).open(folder);
        let pipe = pipe.map_err(|error| format!("cannot write {}: {error}", folder.display()))?;
        return Ok((folder.to_path_buf(), pipe));
    }
    for number in 1..=MAX_FILES {
        let path = folder.join(format!("{name}-{number}.{extension}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(format!("cannot write {}: {error}", path.display())),
        }
    }
    Err(format!(
        "{} has {MAX_FILES} files of this kind already: move them away",
        folder.display()
    ))
}
