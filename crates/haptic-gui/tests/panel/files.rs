//! Exports and recordings: what is asked for, and what is said of them.

use crate::bench::{asked, connected, hear, panel, press, type_into, value_of, wait};
use crate::metadata::metadata;
use crate::plots::{csv_times, rows};
use egui::Key;
use egui_kittest::kittest::Queryable;
use haptic_gui::{Format, Intent, Loaded, RecordingNews, Update};
use haptic_ipc::RigState;
use haptic_lab::recording::{Ending, Place, Totals};

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the panel reads it by its path".to_owned())
    }
}

#[test]
fn a_file_that_is_dropped_on_the_window_is_opened() {
    let mut panel = connected(RigState::Engaged);
    let file = Dropped("/home/ada/r.csv".into());
    panel.input_mut().dropped_files.push(std::sync::Arc::new(file));
    panel.run();
    let path = std::path::PathBuf::from("/home/ada/r.csv");
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
}

#[test]
fn what_is_seen_is_exported() {
    let mut panel = connected(RigState::Engaged);
    for format in Format::ALL {
        press(&mut panel, "Export");
        type_into(&mut panel, "folder to export to", "/tmp/plots");
        let name = format!("export {}", format.extension().to_uppercase());
        press(&mut panel, &name);
        let folder = "/tmp/plots".into();
        assert_eq!(asked(&mut panel), [Intent::Export { format, folder }]);
    }
    hear(&mut panel, Update::Exported(Ok("/tmp/plots/haptic-plot-1.svg".into())));
    panel.get_by_label("Written: /tmp/plots/haptic-plot-1.svg");
    hear(
        &mut panel,
        Update::Exported(Err("cannot write /x: no such folder".into())),
    );
    panel.get_by_label("cannot write /x: no such folder");
    wait(&mut panel, 10.0);
    press(&mut panel, "close the message");
    assert!(panel.query_by_label("cannot write /x: no such folder").is_none());
}

#[test]
fn a_recording_shows_its_length_and_size_until_it_is_ended() {
    let mut panel = connected(RigState::Engaged);
    let (path, totals) = (
        std::path::PathBuf::from("/home/ada/r.csv"),
        Totals {
            rows: 12_300,
            lost: 2,
            missed: 0,
            bytes: 1_810_000,
            length_s: 12.3,
        },
    );
    let going = RecordingNews::Going {
        path: path.clone(),
        totals,
    };
    hear(&mut panel, Update::Recording(going));
    panel.get_by_label("Recording /home/ada/r.csv: 12.3 s, 1.8 MB, 2 samples missing");
    press(&mut panel, "End recording");
    assert_eq!(asked(&mut panel), [Intent::EndRecording]);
    hear(
        &mut panel,
        Update::Recording(RecordingNews::Ended {
            path: path.clone(),
            totals,
        }),
    );
    panel.get_by_label_contains("Recorded /home/ada/r.csv");
    panel.get_by_label("Record");
    press(&mut panel, "Open");
    assert!(panel.get_by_label("recording to open").is_focused());
    assert_eq!(
        value_of(&panel, "recording to open"),
        "/home/ada/r.csv",
        "it may be looked at"
    );
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
    wait(&mut panel, 10.0);
    assert!(
        panel.query_by_label_contains("Recorded").is_none(),
        "it is said for a while"
    );
}

#[test]
fn a_recording_is_looked_at_without_a_daemon() {
    let mut panel = panel();
    press(&mut panel, "Open");
    type_into(&mut panel, "recording to open", "/home/ada/r.csv");
    press(&mut panel, "Open recording");
    let path = std::path::PathBuf::from("/home/ada/r.csv");
    assert_eq!(asked(&mut panel), [Intent::Open { path: path.clone() }]);
    let metadata = metadata();
    let ending = Ending::BrokenOff {
        place: Place::Line(90_005),
        bytes: 7,
    };
    let loaded = Loaded::new(path.clone(), metadata, rows(0..90_000, |_| 1.0), &[], ending);
    hear(
        &mut panel,
        Update::Opened {
            path,
            result: Ok(Box::new(loaded)),
        },
    );
    panel.get_by_label("Force plot");
    panel.get_by_label_contains("broken off in line 90005");
    assert_eq!(csv_times(&panel), (0.0, 89.999), "the whole of it, however long");
    panel.key_press(Key::Escape);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop], "a stop is a stop");
    press(&mut panel, "Close recording");
    assert!(panel.query_by_label("Force plot").is_none());
    let refused = Err("cannot open /x: it is no recording".to_owned());
    hear(
        &mut panel,
        Update::Opened {
            path: "/x".into(),
            result: refused,
        },
    );
    panel.get_by_label("cannot open /x: it is no recording");
}
