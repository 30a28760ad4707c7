//! What holds in every format.

use super::*;

#[test]
fn what_is_there_is_replaced_only_on_demand_and_the_name_says_the_format() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.CSV");
    std::fs::write(&path, "precious").expect("written");
    let error = create(&path, &metadata(), false).map(drop).expect_err("it is there");
    assert!(
        matches!(&error, CreateError::File { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).expect("it is there"), b"precious");
    create(&path, &metadata(), true)
        .expect("replaced")
        .finish()
        .expect("written");
    assert_eq!(read(&path).expect("reads").ending, Ending::Complete);
    for name in ["r", "r.txt", "r.mcap.gz", ".csv"] {
        let error = create(&directory.path().join(name), &metadata(), true)
            .map(drop)
            .expect_err("no format");
        let error = error.to_string();
        for part in [name, ".mcap", ".csv", ".parquet"] {
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
}
