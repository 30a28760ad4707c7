//! What holds in every format.

use super::*;

#[test]
fn existing_file_is_replaced_only_on_demand() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.CSV");
    std::fs::write(&path, "precious").expect("written");
    let error = create(&path, &metadata(), false).map(drop).expect_err("it is there");
    assert!(
        matches!(&error, CreateError::File { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).expect("it is there"), b"precious");
    let replaced = create(&path, &metadata(), true).expect("replaced");
    replaced.finish().expect("written");
    assert_eq!(read(&path).expect("reads").ending, Ending::Complete);
    for name in ["r", "r.txt", "r.mcap.gz", ".csv"] {
        let created = create(&directory.path().join(name), &metadata(), true).map(drop);
        let error = created.expect_err("no format").to_string();
        for part in [name, ".mcap", ".csv", ".parquet"] {
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
}

/// What a progress bar shows, before each entry and at the end.
fn shares(mut reader: Reader) -> Vec<f64> {
    let mut shares = Vec::new();
    loop {
        shares.push(reader.share().expect("a file has a length"));
        match reader.next() {
            Some(entry) => drop(entry.expect("it is whole")),
            None => return shares,
        }
    }
}

#[test]
fn the_share_that_is_read_grows_from_nothing_to_all_of_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let rows: Vec<Sample> = (0..20_000).map(sample).collect();
    for format in [Format::Csv, Format::Mcap, Format::Parquet] {
        let (bytes, _) = written(format, &metadata(), &entries(&rows));
        let path = directory.path().join("r").with_extension(format.ending());
        std::fs::write(&path, &bytes).expect("written");
        let seen = shares(open(&path).expect("opens"));
        let (first, half, last) = (seen[0], seen[seen.len() / 2], seen[seen.len() - 1]);
        assert!(first < 0.1 && seen.is_sorted(), "{format:?} begins with {first}");
        assert!((0.4..0.6).contains(&half), "{format:?}: {half} after half of its rows");
        assert!((0.999..=1.0).contains(&last), "{format:?} ends with {last}");

        // It is being written, and had half of what it has at its end.
        if format == Format::Csv {
            let (early, late) = bytes.split_at(bytes.len() / 2);
            std::fs::write(&path, early).expect("written");
            let reader = open(&path).expect("opens");
            let mut file = std::fs::File::options().append(true).open(&path).expect("opens");
            std::io::Write::write_all(&mut file, late).expect("written");
            let is_share = |share: &f64| *share <= 1.0;
            assert!(shares(reader).iter().all(is_share), "no more than all of it");
            let in_memory = Reader::from_bytes(bytes).expect("opens");
            assert_eq!(in_memory.share(), None, "what is in memory has no file to be read");
        }
    }
}
