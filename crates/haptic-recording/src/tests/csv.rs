//! CSV alone.

use super::*;
use haptic_ipc::{SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS};

fn recording(rows: &[Sample]) -> Vec<u8> {
    written(Format::Csv, &metadata(), &entries(rows)).0
}

#[test]
fn a_recording_reads_as_its_description_shows_it() {
    let cells = "1,0.001,engaged,-1,0.1,-0.2,0.3333333333333333,0.0,5.5,-5.5,7,100,200,0,0,0,0,0.0,0,0";
    let both = [SAMPLE_COLUMNS, &SAMPLE_Y_COLUMNS].concat();
    for (axes, y, columns, cells) in [
        (1, None, SAMPLE_COLUMNS.join(","), cells.to_owned()),
        (
            2,
            Some(SampleY::of_cells([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])),
            both.join(","),
            format!("{cells},0.1,0.2,0.3,0.4,0.5,0.6,0.7"),
        ),
    ] {
        let about = Metadata { axes, ..metadata() };
        let bytes = written(Format::Csv, &about, &[Entry::Row(sample(1), y)]).0;
        let text = String::from_utf8(bytes).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], format!("# hapticd recording {axes}"));
        let begin = r##"# {"server":"hapticd 0.1.0","device":"fake rig, \"of glass\"","loop_rate_hz""##;
        assert!(lines[1].starts_with(begin), "{}", lines[1]);
        assert_eq!(lines[2..4], [columns, cells]);
        assert_eq!(lines[4], r##"# {"mark":"end","rows":1,"lost":0,"missed":0}"##);
        let (short, _) = lines[3].rsplit_once(',').expect("cells");
        let error = read_bytes(text.replacen(lines[3], short, 1).as_bytes()).expect_err("a cell is missing");
        let (found, wanted) = (short.split(',').count(), lines[3].split(',').count());
        let reason = format!("{found} cells of {wanted}");
        assert!(error.to_string().contains(&reason), "{reason}: {error}");
    }
}

#[test]
fn broken_off_recording_reads_up_to_its_last_whole_row() {
    let rows: Vec<Sample> = (1..6).map(sample).collect();
    let whole = recording(&rows);
    let text = String::from_utf8(whole.clone()).expect("text");
    let header_ends = text.match_indices('\n').nth(2).expect("three lines").0 + 1;
    for length in header_ends..whole.len() {
        let cut = read_bytes(&whole[..length]).expect("what is whole reads");
        let whole_lines = text[header_ends..length].matches('\n').count();
        assert_eq!(cut.rows, rows[..whole_lines], "cut at {length}");
        if text[..length].ends_with('\n') {
            assert_eq!(cut.ending, Ending::Open, "cut at {length}");
        } else {
            assert!(matches!(cut.ending, Ending::BrokenOff { .. }), "cut at {length}");
            assert!(cut.ending.to_string().contains("broken off in line"), "{}", cut.ending);
        }
    }
    assert_eq!(read_bytes(&whole).expect("reads").ending, Ending::Complete);
    let error = read_bytes(&whole[..header_ends - 1]).expect_err("there is no row");
    assert!(error.to_string().contains("before its first row"), "{error}");
}

#[test]
fn a_writer_that_dies_has_passed_on_all_but_its_last_second() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("dies.csv");
    let mut writer = Writer::create(&path, &metadata(), false).expect("begun");
    assert_eq!(read(&path).expect("the header is there at once").ending, Ending::Open);
    writer.rows(&[sample(1)], &[]).expect("written");
    std::thread::sleep(std::time::Duration::from_millis(1010));
    writer.rows(&[sample(2)], &[]).expect("written");
    let found = read(&path).expect("reads while it is being written");
    assert_eq!(found.rows.len(), 2);
    // As a process that is killed: what is in memory is lost.
    std::mem::forget(writer);
}

/// Asserts that a damaged recording is refused with these words.
fn check(damaged: &str, parts: &[&str]) {
    let error = read_bytes(damaged.as_bytes()).expect_err("damaged").to_string();
    for part in parts {
        assert!(error.contains(part), "{error} lacks {part}");
    }
}

#[test]
fn what_is_no_recording_is_refused_by_its_line() {
    let whole = String::from_utf8(recording(&[sample(1), sample(2)])).expect("text");
    let of_two = whole.replace("recording 1", "recording 2");
    let cells = whole.replacen(",0.0,0,0\n2,", "\n2,", 1);
    for (damaged, parts) in [
        (String::new(), ["line 1", "", ""]),
        ("t_s,x\n0,0\n".to_owned(), ["begins with `t_s,x`", "", ""]),
        ("\u{7f}ELF".to_owned(), ["not a recording", "", ""]),
        (of_two, ["line 3: expected column 21", "`device_position_y_m`", "``"]),
        (cells, ["line 4", "is not a row", "17 cells of 20"]),
        (format!("{}\n", "9".repeat(2 << 20)), ["line 1 is longer", "", ""]),
    ] {
        check(&damaged, &parts);
    }
    for (wanted, by, parts) in [
        ("recording 1", "recording 3", ["version 3", "reads versions 1 and 2"]),
        ("\"rate_hz\"", "\"rate\"", ["metadata", "rate_hz"]),
        ("# {\"server", "# {server", ["line 2", "metadata"]),
        (
            "block_position_m",
            "block_m",
            ["line 3: expected column 7", "`block_position_m`, found `block_m`"],
        ),
        ("2,0.002,", "2,soon,", ["line 5", "soon"]),
        ("2,0.002,engaged", "2,0.002,asleep", ["line 5", "asleep"]),
        ("\"rows\":2", "\"rows\":two", ["line 6", "is not a mark"]),
    ] {
        check(&whole.replace(wanted, by), &parts);
    }
    let error = read(std::path::Path::new("/nonexistent.csv")).expect_err("no file");
    assert!(error.to_string().contains("/nonexistent.csv"), "{error}");
}

#[test]
fn remarks_and_what_a_later_version_adds_are_passed_over() {
    let whole = String::from_utf8(recording(&[sample(1)])).expect("text");
    let later = whole.replace("error_detail\n", "error_detail,mood\n").replace(
        ",0.0,0,0\n",
        ",0.0,0,0,good\n\n# a remark\n# {\"mark\":\"weather\",\"wind\":3}\n",
    );
    assert_ne!(later, whole);
    let plain = read_bytes(whole.as_bytes()).expect("reads");
    for other in [later, whole.replace('\n', "\r\n")] {
        assert_eq!(read_bytes(other.as_bytes()).expect("reads"), plain);
    }
}
