//! Recordings of two axes.

use super::*;
use haptic_ipc::{Event, SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS, SamplesEvent};

fn about() -> Metadata {
    Metadata { axes: 2, ..metadata() }
}

/// The second axis of a tick, each number another one.
fn y(tick: u64) -> SampleY {
    let tick = f64::from(u32::try_from(tick).expect("small"));
    SampleY::of_cells(std::array::from_fn(|place| tick + 0.1 * place as f64))
}

fn rows(ticks: std::ops::RangeInclusive<u64>) -> Vec<Entry> {
    ticks.map(|tick| Entry::Row(sample(tick), Some(y(tick)))).collect()
}

#[test]
fn csv_has_the_second_axis_behind_the_first() {
    let (bytes, _) = written(Format::Csv, &about(), &rows(7..=7));
    let text = String::from_utf8(bytes).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[2], [SAMPLE_COLUMNS, &SAMPLE_Y_COLUMNS].concat().join(","));
    let cells = lines[3].split(',').skip(SAMPLE_COLUMNS.len());
    let cells: Vec<f64> = cells.map(|cell| cell.parse().expect("a number")).collect();
    assert_eq!(cells, y(7).cells());
    let short = text.replacen(&format!(",{}\n", lines[3].rsplit(',').next().expect("a cell")), "\n", 1);
    let error = read_bytes(short.as_bytes()).expect_err("a cell is missing").to_string();
    assert!(error.contains("line 4") && error.contains("26 cells of 27"), "{error}");
}

#[test]
fn two_axes_are_refused_where_one_is_wanted() {
    let folder = in_memory();
    for format in Format::ALL {
        let path = folder.path().join("r").with_extension(format.ending());
        std::fs::write(&path, written(format, &about(), &rows(1..=3)).0).expect("written");
        for error in [open(&path).map(drop), read(&path).map(drop)] {
            let error = error.expect_err("two axes");
            assert!(error.to_string().contains("two axes"), "{error}");
            assert!(!error.is_damage() && error.remedy().is_empty());
        }
        let found = open_any(&path).expect("opens").into_recording().expect("reads");
        assert_eq!(found.rows_y, [1, 2, 3].map(y));
        assert_eq!(found.rows.len(), 3);
    }
}

#[test]
fn rows_of_another_rig_are_refused() {
    let folder = in_memory();
    for (axes, ys, part) in [
        (1, vec![y(1)], "rows of a rig of two axes in a recording of one"),
        (2, Vec::new(), "rows of a rig of one axis in a recording of two"),
    ] {
        let path = folder.path().join(format!("{axes}.csv"));
        let mut writer = Writer::create(&path, &Metadata { axes, ..metadata() }, false).expect("begun");
        let error = writer.rows(&[sample(1)], &ys).expect_err("another rig").to_string();
        assert!(error.contains(part), "{error}");
        assert_eq!(writer.totals().rows, 0);
    }
}

#[test]
fn events_become_rows_around_the_marks() {
    let folder = in_memory();
    let path = folder.path().join("r.mcap");
    let mut recorder = create(&path, &about(), false).expect("begun");
    let marker = Mark::Marker {
        tick: 3,
        text: "here".into(),
    };
    recorder.mark(marker.clone());
    let ticks = [1, 2, 3, 6, 7];
    let event = Event::Samples(SamplesEvent {
        rows: ticks.map(sample).to_vec(),
        rows_y: ticks.map(y).to_vec(),
        ..SamplesEvent::default()
    });
    recorder.event(&event).expect("written");
    recorder.finish().expect("written");
    let found = open_any(&path).expect("opens").into_recording().expect("reads");
    assert_eq!(
        (found.rows, found.rows_y),
        (ticks.map(sample).to_vec(), ticks.map(y).to_vec())
    );
    let marks: Vec<_> = found.marks.into_iter().take(2).collect();
    assert_eq!(marks, [(2, marker), (3, Mark::Lost { rows: 2 })]);
}

#[test]
fn cut_and_repair_keep_the_second_axis() {
    let folder = in_memory();
    let whole = folder.path().join("whole.mcap");
    let (bytes, _) = written(Format::Mcap, &about(), &rows(1..=9));
    std::fs::write(&whole, &bytes).expect("written");
    let part = folder.path().join("part.parquet");
    cut(&whole, &part, &Span::Ticks(4..6), false, None).expect("cut");
    let found = open_any(&part).expect("opens").into_recording().expect("reads");
    assert_eq!((found.metadata.axes, found.rows_y), (2, vec![y(4), y(5)]));

    let torn = folder.path().join("torn.csv");
    let (bytes, _) = written(Format::Csv, &about(), &rows(1..=9));
    std::fs::write(&torn, &bytes[..bytes.len() - 60]).expect("written");
    let repaired = repair(&torn, &torn, true).expect("repaired");
    let found = open_any(&torn).expect("opens").into_recording().expect("reads");
    assert_eq!(found.ending, Ending::Complete);
    assert_eq!(found.rows_y.len() as u64, repaired.totals.rows);
    assert_eq!(found.rows_y[7], y(8));
}
