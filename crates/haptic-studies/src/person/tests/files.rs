//! What is on the disk beside the rows.

use super::super::super::trial::Trial;
use super::*;

#[test]
fn a_break_is_counted_in_whole_seconds() {
    let text = small_fitts().replace("rest_every_segments = 9", "rest_every_segments = 1");
    let (_parent, folder) = a_study(&text);
    let mut person = Person::new(&folder);
    while !matches!(person.phase(), Phase::Rest { .. }) {
        person.find_target();
        person.click();
    }
    for (ticks, remaining_s) in [(0, 60), (1, 60), (999, 59), (59_000, 0)] {
        person.ticks(ticks);
        assert_eq!(person.phase(), Phase::Rest { remaining_s });
    }
    person.end();
}

#[test]
fn the_screen_of_a_subject_is_described_beside_its_rows() {
    let (_parent, folder) = a_study(&small_fitts());
    let mut person = Person::new(&folder);
    while person.phase() != Phase::Done {
        person.find_target();
        let (latency_s, lasted_s) = (0.02, 0.0125);
        person.session.frame(Frame { latency_s, lasted_s });
        person.click();
    }
    person.end();
    let path = folder.join("data/subject-P7/session-01/subject-P7_session-01_task-fitts_data.json");
    let text = std::fs::read_to_string(path).expect("it is there");
    let described: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let variables = described["variableMeasured"].as_array().expect("a list");
    assert_eq!(variables.len(), FittsTrial::COLUMNS.len());
    let value = |name: &str| {
        let variable = variables.iter().find(|variable| variable["name"] == name).expect(name);
        let how = variable["measurementTechnique"].as_str().expect("a text");
        assert!(how.contains("sample on the device"), "{how}");
        variable["value"].as_f64()
    };
    assert_eq!(value("cursor_latency_s"), Some(0.02));
    assert_eq!(value("cursor_latency_p95_s"), Some(0.02));
    assert_eq!(value("frame_rate_hz"), Some(80.0));
}

#[test]
fn earlier_version_rows_continue_and_unknown_column_is_refused() {
    let (_parent, folder) = a_study(&small_fitts());
    let click = |times: usize| {
        let mut person = Person::new(&folder);
        for _ in 0..times {
            person.find_target();
            person.click();
        }
        person.end()
    };
    assert_eq!(click(2).len(), 1);
    let path = folder.join("data/subject-P7/session-01/subject-P7_session-01_task-fitts_practice.csv");
    let whole = std::fs::read_to_string(&path).expect("rows");
    // As they were before the frames were counted: the cell is empty, as the test has no screen.
    let earlier = whole.replace(",frame_rate_hz", "").replace(",,,data/", ",,data/");
    assert_eq!(earlier.len() + ",frame_rate_hz,".len(), whole.len());
    std::fs::write(&path, &earlier).expect("written");
    assert_eq!(click(2).len(), 1);
    let text = std::fs::read_to_string(&path).expect("rows");
    assert!(text.starts_with(&whole) && text.lines().count() == 3, "{text}");
    std::fs::write(&path, text.replace("frame_rate_hz", "mood")).expect("written");
    let error = refused(&folder, "P7");
    assert!(
        error.contains("_practice.csv: the column `mood` is none of this program's"),
        "{error}"
    );
}
