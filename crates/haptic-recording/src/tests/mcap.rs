//! MCAP alone, read by another reader as well.

use super::*;
use ::mcap::MessageStream;
use ::mcap::read::Summary;

/// Messages by topic, as the crate's own reader counts them.
fn messages(bytes: &[u8]) -> Result<[usize; 2], ::mcap::McapError> {
    let mut counts = [0; 2];
    for message in MessageStream::new(bytes)? {
        let message = message?;
        let schema = message.channel.schema.as_ref().expect("every channel has one");
        let (topic, encoding) = (&*message.channel.topic, &*message.channel.message_encoding);
        match (topic, encoding, &*schema.name, &*schema.encoding) {
            ("/hapticd/samples", "cdr", "hapticd/msg/Sample", "ros2msg") => counts[0] += 1,
            ("/hapticd/marks", "json", _, "jsonschema") => counts[1] += 1,
            other => panic!("{other:?}"),
        }
    }
    Ok(counts)
}

fn rows(count: u64) -> Vec<Sample> {
    (1..=count).map(sample).collect()
}

#[test]
fn a_file_is_whole_after_each_flush_without_an_end() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.mcap");
    let mut writer = Writer::create(&path, &metadata(), false).expect("begun");
    let whole = |least: u64| {
        let bytes = std::fs::read(&path).expect("it is there");
        let [flushed, marks] = messages(&bytes).expect("whole");
        assert!(flushed as u64 >= least, "{flushed} of {least} rows");
        assert!(Summary::read(&bytes).expect("whole").is_none());
        let found = read_bytes(&bytes).expect("reads");
        assert_eq!(found.rows, rows(flushed as u64));
        assert_eq!((found.ending, found.metadata), (Ending::Open, metadata()));
        assert_eq!(found.marks.len(), marks);
        marks
    };
    assert_eq!(whole(0), 0);
    for row in rows(600) {
        writer.rows(&[row], &[]).expect("written");
        if row.tick % 50 == 0 {
            assert_eq!(whole(row.tick.saturating_sub(249)), 0);
        }
    }
    writer.mark(&Mark::Lost { rows: 3 }).expect("written");
    writer.flush().expect("written");
    assert_eq!(whole(600), 1);
    writer.flush().expect("there is nothing to be written");
    assert_eq!(whole(600), 1);
    // As a process that is killed.
    std::mem::forget(writer);
}

#[test]
fn a_recording_that_was_ended_says_how_much_it_holds() {
    let (bytes, totals) = written(Format::Mcap, &metadata(), &entries(&rows(600)));
    assert_eq!((totals.rows, totals.bytes), (600, bytes.len() as u64));
    assert_eq!(messages(&bytes).expect("whole"), [600, 1]);
    let summary = Summary::read(&bytes).expect("whole").expect("it has one");
    let statistics = summary.stats.expect("it has some");
    assert_eq!((statistics.message_count, statistics.metadata_count), (601, 1));
    assert_eq!(statistics.chunk_count, 3);
    let started_ns = 1_763_748_187_122_999_808; // The double next to it.
    assert_eq!(statistics.message_start_time, started_ns);
    assert_eq!(statistics.message_end_time, started_ns + 599_000_000);
    assert_eq!(summary.chunk_indexes.len(), 3, "a viewer goes to any moment");
    assert_eq!(summary.metadata_indexes[0].name, "hapticd recording");
}

#[test]
fn what_is_cut_anywhere_reads_up_to_its_last_whole_row() {
    let whole = written(Format::Mcap, &metadata(), &entries(&rows(5))).0;
    let mut found_rows = 0;
    let mut is_headed = false;
    for length in 8..whole.len() {
        match read_bytes(&whole[..length]) {
            Ok(found) => {
                is_headed = true;
                assert!(found.rows.len() >= found_rows, "cut at {length}");
                found_rows = found.rows.len();
                assert_eq!(found.rows, rows(found_rows as u64), "cut at {length}");
            }
            Err(error) => {
                assert!(!is_headed, "cut at {length}: {error}");
                assert!(error.to_string().contains("before its first row"), "{error}");
            }
        }
    }
    assert_eq!(found_rows, 5);
    // Within the third row.
    let third = whole.windows(8).position(|bytes| bytes == 3_u64.to_le_bytes());
    let torn = read_bytes(&whole[..third.expect("it is there") + 40]).expect("reads");
    assert_eq!(torn.rows, rows(2));
    let Ending::BrokenOff { bytes, .. } = torn.ending else {
        panic!("{}", torn.ending);
    };
    assert!((40..150).contains(&bytes), "{bytes}");
    let said = torn.ending.to_string();
    assert!(said.contains("broken off in byte"), "{said}");
    // A disk without power may leave zeros in place of what was to be written.
    let dark = read_bytes(&[&whole[..whole.len() - 8], &[0; 4096]].concat()).expect("reads");
    assert_eq!(dark.rows, rows(5));
    let started = written(Format::Mcap, &metadata(), &[]).0;
    let is_chunk = |bytes: &[u8]| bytes[0] == 6 && bytes[3..] == [0; 6];
    let end = started.windows(9).position(is_chunk).expect("a chunk");
    let dark = read_bytes(&[&started[..end], &[0; 4096]].concat()).expect("reads");
    let is_told = matches!(dark.ending, Ending::BrokenOff { bytes: 4096, .. });
    assert!(is_told, "{}", dark.ending);
}

#[test]
fn what_is_damaged_is_refused_by_its_place() {
    let whole = written(Format::Mcap, &metadata(), &entries(&rows(2))).0;
    let place = |wanted: &[u8]| {
        let mut windows = whole.windows(wanted.len());
        windows.position(|bytes| bytes == wanted).expect("it is there")
    };
    let changed = |wanted: &[u8], by: &[u8]| {
        let (mut bytes, at) = (whole.clone(), place(wanted));
        bytes[at..at + by.len()].copy_from_slice(by);
        bytes
    };
    let (position, version) = (0.1_f64.to_le_bytes(), b"version\x01\0\0\x001");
    let changes: [(&[u8], &[u8], [&str; 2]); 6] = [
        (&position, &[1], ["byte ", "checksum of a chunk"]),
        (
            b"hapticd recording",
            b"haptics",
            ["hapticd did not write this MCAP file", ""],
        ),
        (
            version,
            b"version\x01\0\0\x003",
            ["version 3", "reads versions 1 and 2"],
        ),
        (version, b"version\x01\0\0\x002", ["no field `device_position_y_m`", ""]),
        (b"loop_rate_hz", b"loup", ["metadata", "loop_rate_hz"]),
        (b"uint64 tick", b"uint32 tick", ["checksum of a chunk", ""]),
    ];
    for (wanted, by, parts) in changes {
        let error = read_bytes(&changed(wanted, by)).expect_err("damaged").to_string();
        for part in parts {
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
    let mut long = whole[..place(b"hapticd recording") - 13].to_vec();
    long.extend([0x0c, 0, 0, 0, 0, 0, 0, 0, 1]);
    let error = read_bytes(&long).expect_err("a metadata record of 72 PB").to_string();
    assert!(error.contains("a record of 72057594037927936 bytes"), "{error}");
}

/// Says to the test below that it is the process whose files have a limit.
const LIMITED: &str = "HAPTICD_TEST_LIMITED_FILE";

#[test]
fn a_disk_that_is_full_keeps_a_whole_file() {
    if let Some(path) = std::env::var_os(LIMITED) {
        let mut writer = Writer::create(Path::new(&path), &metadata(), false).expect("begun");
        let error = rows(5000).iter().find_map(|row| writer.rows(&[*row], &[]).err());
        println!("{}", error.expect("there is no room"));
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.mcap");
    // 200 blocks of 512 bytes. A shell that ignores the signal hands that on.
    let output = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 200; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().expect("it runs"))
        .args(["--exact", "--nocapture"])
        .arg("tests::mcap::a_disk_that_is_full_keeps_a_whole_file")
        .env(LIMITED, &path)
        .output()
        .expect("a shell");
    let printed = String::from_utf8_lossy(&output.stdout);
    let is_full = printed.contains("File too large");
    assert!(output.status.success() && is_full, "{printed}");
    let bytes = std::fs::read(&path).expect("it is there");
    let [found, _] = messages(&bytes).expect("whole");
    assert_eq!(found, 500, "two flushes fit into 102400 bytes");
    assert_eq!(read_bytes(&bytes).expect("reads").ending, Ending::Open);
}
