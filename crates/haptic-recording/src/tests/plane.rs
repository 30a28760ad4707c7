//! Recordings of two axes.

use super::*;

pub(super) fn about() -> Metadata {
    Metadata { axes: 2, ..metadata() }
}

/// The second axis of a tick, each number another one.
pub(super) fn y(tick: u64) -> SampleY {
    let tick = f64::from(u32::try_from(tick).expect("small"));
    SampleY::of_cells(std::array::from_fn(|place| tick + 0.1 * place as f64))
}

#[test]
fn two_axes_are_refused_where_one_is_wanted() {
    let folder = in_memory();
    let rows = [1, 2, 3].map(|tick| Entry::Row(sample(tick), Some(y(tick))));
    for format in Format::ALL {
        let path = folder.path().join("r").with_extension(format.ending());
        std::fs::write(&path, written(format, &about(), &rows).0).expect("written");
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
