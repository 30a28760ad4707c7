//! Exports and recordings: what is asked for, and what is shown of them.

use crate::bench::{
    Hands as _, Panel, asked, at_page, connected, hear, is_enabled, lose_the_daemon, panel, press, type_into, value_of,
    wait,
};
use crate::metadata::metadata;
use crate::plots::{csv_times, feel, felt, rows, svg};
use crate::rig::status;
use crate::scene::active_scene;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use haptic_core::Scene;
use haptic_ipc::RigState;
use haptic_panel::{About, DialogPurpose, Format, Intent, Length, Listed, Loaded, Page, RecordingNews, Update};
use haptic_recording::{Ending, Place, Totals};
use std::path::{Path, PathBuf};

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the panel reads it by its path".to_owned())
    }
}

#[test]
fn a_file_that_is_dropped_on_the_window_is_opened() {
    let mut panel = connected(RigState::Engaged);
    let path = PathBuf::from("/home/ada/r.csv");
    let file = std::sync::Arc::new(Dropped(path.clone()));
    panel.input_mut().dropped_files.push(file);
    panel.run();
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
    let why = "cannot write /x: no such folder";
    hear(&mut panel, Update::Exported(Err(why.into())));
    panel.get_by_label(why);
    wait(&mut panel, 10.0);
    press(&mut panel, "close the message");
    assert!(panel.query_by_label(why).is_none());
}

#[test]
fn every_path_field_has_a_desktop_dialog_button() {
    let mut panel = connected(RigState::Engaged);
    let asked_near_plots = |panel: &mut Panel, purpose| {
        let near = "/tmp/plots".into();
        assert_eq!(asked(panel), [Intent::Choose { purpose, near }]);
    };
    for format in Format::ALL {
        press(&mut panel, "Export");
        type_into(&mut panel, "folder to export to", "/tmp/plots");
        press(&mut panel, &format!("export {} as", format.extension().to_uppercase()));
        asked_near_plots(&mut panel, DialogPurpose::Export(format));
    }
    press(&mut panel, "Export");
    press(&mut panel, "choose folder to export to");
    asked_near_plots(&mut panel, DialogPurpose::Folder);
    let mut panel = at_page(panel, Page::Record);
    press(&mut panel, "choose folder");
    asked_near_plots(&mut panel, DialogPurpose::Folder);
    press(&mut panel, "choose recording");
    asked_near_plots(&mut panel, DialogPurpose::Recording);
    hear(
        &mut panel,
        Update::DialogClosed(Ok(Some((DialogPurpose::Folder, "/home/ada".into())))),
    );
    asked(&mut panel);
    assert_eq!(value_of(&panel, "folder of recordings"), "/home/ada");
    hear(&mut panel, Update::DialogClosed(Ok(None)));
    hear(&mut panel, Update::DialogClosed(Err("there is no portal".into())));
    panel.get_by_label("Type the path: there is no portal");
    for (page, field, purpose) in [
        ("Identify page", "file to identify", DialogPurpose::FileToIdentify),
        ("Task page", "folder of the study", DialogPurpose::StudyFolder),
        ("Task page", "plan of the study", DialogPurpose::StudyPlan),
    ] {
        press(&mut panel, page);
        type_into(&mut panel, field, "/tmp/near");
        press(&mut panel, &format!("choose {field}"));
        let choose = Intent::Choose {
            purpose,
            near: "/tmp/near".into(),
        };
        assert!(asked(&mut panel).contains(&choose), "{field}");
        let chosen = (purpose, "/home/ada/it".into());
        hear(&mut panel, Update::DialogClosed(Ok(Some(chosen))));
        assert_eq!(value_of(&panel, field), "/home/ada/it");
    }
}

#[test]
fn a_recording_shows_its_length_and_size_until_it_is_ended() {
    let mut panel = at_page(connected(RigState::Engaged), Page::Record);
    let path = PathBuf::from("/home/ada/r.csv");
    let totals = Totals {
        lost: 2,
        bytes: 1_810_000,
        length_s: 12.3,
        ..Totals::default()
    };
    let of = path.clone();
    hear(&mut panel, Update::Recording(RecordingNews::Going { path: of, totals }));
    panel.get_by_label("Recording /home/ada/r.csv: 12.3 s, 1.8 MB, 2 samples missing");
    press(&mut panel, "End recording");
    assert_eq!(asked(&mut panel), [Intent::EndRecording]);
    let of = path.clone();
    hear(&mut panel, Update::Recording(RecordingNews::Ended { path: of, totals }));
    panel.get_by_label_contains("Recorded /home/ada/r.csv");
    panel.get_by_label("Record");
    assert_eq!(
        value_of(&panel, "recording to open"),
        "/home/ada/r.csv",
        "it may be looked at"
    );
    asked(&mut panel);
    press(&mut panel, "Open recording");
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
    wait(&mut panel, 10.0);
    assert!(
        panel.query_by_label_contains("Recorded").is_none(),
        "it is shown for a while"
    );
}

#[test]
fn a_recording_is_looked_at_without_a_daemon() {
    let mut panel = at_page(panel(), Page::Record);
    let path = PathBuf::from("/home/ada/r.csv");
    let reading = Update::Reading {
        path: path.clone(),
        share: Some(0.42),
    };
    let share = "share of r.csv that is read";
    assert!(panel.query_by_label("Stop").is_some());
    hear(&mut panel, reading.clone());
    panel.get_by_label(share);
    assert!(panel.query_by_label("Stop").is_none(), "while it is being read, too");
    type_into(&mut panel, "recording to open", "/home/ada/r.csv");
    press(&mut panel, "Open recording");
    assert_eq!(asked(&mut panel), [Intent::Open { path: path.clone() }]);
    let ending = Ending::BrokenOff {
        place: Place::Line(90_005),
        bytes: 7,
    };
    let loaded = Loaded::new(path.clone(), metadata(), rows(0..90_000, |_| 1.0), &[], ending);
    let (opened, result) = (path.clone(), Ok(Box::new(loaded)));
    hear(&mut panel, Update::Opened { path: opened, result });
    assert!(panel.query_by_label(share).is_none());
    panel.get_by_label("Force plot");
    lose_the_daemon(&mut panel);
    panel.get_by_label("No daemon");
    assert!(panel.query_by_label("Stop").is_none(), "there was never a rig to stop");
    press(&mut panel, "Tune page");
    panel.get_by_label("Not connected to a daemon");
    assert!(panel.query_by_label("Stop").is_none(), "on no page");
    press(&mut panel, "Record page");
    panel.get_by_label_contains("broken off in line 90005");
    assert_eq!(csv_times(&panel), (0.0, 89.999), "the whole of it, however long");
    panel.hit(Key::Escape);
    assert_eq!(asked(&mut panel), [Intent::Stop], "a stop is a stop");
    panel.get_by_label("Stop");
    press(&mut panel, "Close recording");
    assert!(panel.query_by_label("Force plot").is_none());
    hear(&mut panel, reading);
    let result = Err("cannot open /x: it is no recording".to_owned());
    hear(&mut panel, Update::Opened { path, result });
    assert!(panel.query_by_label(share).is_none());
    panel.get_by_label("cannot open /x: it is no recording");
}

pub(crate) fn going(path: &str) -> Update {
    Update::Recording(RecordingNews::Going {
        path: path.into(),
        totals: Totals::default(),
    })
}

#[test]
fn recording_defaults_to_mcap_and_begins_with_notes() {
    let mut panel = at_page(connected(RigState::Engaged), Page::Record);
    assert!(!is_enabled(&panel, "Record"), "there is no status yet");
    hear(&mut panel, active_scene(1, &Scene::paper()));
    hear(&mut panel, Update::Status(Ok(Box::new(status()))));
    let recorded = |panel: &mut Panel| {
        press(panel, "Record");
        match asked(panel).pop() {
            Some(Intent::Record { format, metadata, .. }) => (format, *metadata),
            other => panic!("{other:?}"),
        }
    };
    let (format, metadata) = recorded(&mut panel);
    assert_eq!((format, metadata.notes), (haptic_recording::Format::Mcap, None));
    let configuration = metadata.configuration.expect("the daemon's status");
    assert_eq!(configuration["velocity_estimator"], "foaw");
    for (ending, format) in [
        ("csv", haptic_recording::Format::Csv),
        ("mcap", haptic_recording::Format::Mcap),
    ] {
        press(&mut panel, ending);
        assert_eq!(recorded(&mut panel).0, format);
    }
    press(&mut panel, "parquet");
    type_into(&mut panel, "notes of the recording", "slow-pulls");
    panel.hit(Key::Tab);
    let (format, metadata) = recorded(&mut panel);
    assert_eq!(format, haptic_recording::Format::Parquet);
    assert_eq!(metadata.notes.as_deref(), Some("slow-pulls"));
}

#[test]
fn recordings_of_the_folder_are_listed_and_open_on_click() {
    let mut panel = at_page(connected(RigState::Engaged), Page::Record);
    type_into(&mut panel, "folder of recordings", "/home/ada/pulls");
    assert_eq!(asked(&mut panel), [], "a half-typed folder is not read");
    panel.hit(Key::Enter);
    let folder = PathBuf::from("/home/ada/pulls");
    let list = |known: Vec<Listed>| Intent::List {
        folder: folder.clone(),
        known,
    };
    assert_eq!(asked(&mut panel), [list(Vec::new())]);
    panel.run();
    assert_eq!(asked(&mut panel), [], "once");
    let listed = Listed {
        path: folder.join("slow.mcap"),
        bytes: 1,
        modified: std::time::SystemTime::UNIX_EPOCH,
        about: Ok(About {
            scene: "paper".to_owned(),
            notes: Some("with gloves".to_owned()),
            length: Some(Length {
                length_s: 12.34,
                is_complete: true,
            }),
        }),
    };
    let update = Update::Listed {
        folder: folder.clone(),
        listed: Box::new(listed.clone()),
    };
    hear(&mut panel, update);
    let (ended, result) = (folder.clone(), Ok(()));
    hear(&mut panel, Update::ListRead { folder: ended, result });
    panel.get_by_label("12.3 s, scene paper, with gloves");
    press(&mut panel, "open slow.mcap");
    let path = listed.path.clone();
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
    press(&mut panel, "Read again");
    assert_eq!(
        asked(&mut panel),
        [list(vec![listed])],
        "what is known is not read again"
    );
    let result = Err("cannot read /home/ada/pulls: gone".to_owned());
    let ended = folder.clone();
    hear(&mut panel, Update::ListRead { folder: ended, result });
    panel.get_by_label("cannot read /home/ada/pulls: gone");
    assert!(panel.query_by_label("open slow.mcap").is_none());
}

#[test]
fn marker_is_set_by_key_or_button_and_shown_on_time_axis() {
    let mut panel = felt(0..2000, |_| 1.0);
    panel.hit(Key::M);
    assert_eq!(asked(&mut panel), [], "nothing is recorded");
    hear(&mut panel, going("/home/ada/r.mcap"));
    panel.hit(Key::M);
    let marker = |tick: u64, text: &str| Intent::Marker {
        tick,
        text: text.to_owned(),
    };
    assert_eq!(asked(&mut panel), [marker(1999, "marker 1")]);
    feel(&mut panel, &rows(2000..3000, |_| 1.0));
    // In the field the key is a letter.
    let mut panel = at_page(panel, Page::Record);
    type_into(&mut panel, "text of the marker", "my-turn");
    panel.hit(Key::M);
    assert_eq!(asked(&mut panel), []);
    press(&mut panel, "Mark (M)");
    assert_eq!(asked(&mut panel), [marker(2999, "my-turn")]);
    hear(&mut panel, going("/home/ada/r.mcap"));
    panel.hit_with(Modifiers::COMMAND, Key::M);
    assert_eq!(asked(&mut panel), [], "another key");
    let svg = svg(&panel);
    for text in ["marker 1", "my-turn"] {
        assert_eq!(svg.matches(&format!(">{text}</text>")).count(), 1, "{text}");
    }
}
