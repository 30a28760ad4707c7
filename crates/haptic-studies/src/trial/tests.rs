use super::*;

/// Rows as they are written, by all rows at once and one by one, and read to the last bit.
fn reads_back<T: Trial>(row: &str) {
    let heading = T::names().collect::<Vec<_>>().join(",");
    let text = format!("{heading}\n{row}\n{row}\n");
    let trials = read::<T>(text.as_bytes()).expect("read");
    let mut whole = Vec::new();
    write(&trials, &mut whole).expect("written");
    let by_line = [line(&trials[0], true), line(&trials[1], false)].map(|line| line.expect("written"));
    for written in [whole, by_line.concat()] {
        assert_eq!(String::from_utf8(written).expect("text"), text);
    }
}

#[test]
fn rows_read_back_to_the_last_bit() {
    reads_back::<FittsTrial>(
        "simulated,01,1,3,high stiction,5,8,-1,0.45,0.06,0.006,-0.03333333333333333,0.731,2,0.0123,\
         18446744073709551615,1,7,1,0.021,0.034,60.0,\"data/a, b.mcap\"",
    );
    reads_back::<PerceptionTrial>(",s,2,C,staircase,1,4.0,3.5,3.0,2.5,1.0,true,2,true,0.4,false,,,0,");
}

const ELSEWHERE: &str =
    "trial,subject,block,resistance,condition,amplitude_m,width_m,end_error_m,movement_time_s,errors,mood\n";

#[test]
fn a_file_from_elsewhere_needs_the_required_columns_alone() {
    let text = format!("{ELSEWHERE}1, x7,2,drag,5,0.3,0.04,-0.006,0.612,1,fair\n");
    let read_back = read::<FittsTrial>(text.as_bytes()).expect("read");
    let [trial] = &read_back[..] else { panic!("one row") };
    assert_eq!((trial.subject.as_str(), trial.session, trial.operator), ("x7", 1, None));
    assert_eq!((trial.end_error_m, trial.errors), (-0.006, 1));
    assert_eq!(trial.direction, None);
}

#[test]
fn a_wrong_file_is_refused_by_line_column_value_and_limit() {
    for (row, message) in [
        (
            "1,x,2,drag,5,0.3,wide,0,0.6,1,",
            "line 2: width_m = `wide`: it must be a number, as in 0.6",
        ),
        (
            "1,x,2,drag,5,-0.3,0.04,0,0.6,1,",
            "line 2: amplitude_m = -0.3 m is out of range: it must be above 0 m, and at most 10 m",
        ),
        (
            "1,x,2,drag,5,0.3,0.04,NaN,0.6,1,",
            "line 2: end_error_m = NaN m is out of range: it must be -10 m to 10 m",
        ),
        (
            "1,x,2,drag,5,0.3,0.04,0,0.6,-1,",
            "line 2: errors = `-1`: it must be a whole number; counts are not below 0",
        ),
        (
            "1,x,2,drag,5,0.3,0.04,0,612,1,",
            "line 2: movement_time_s = 612 s is out of range: it must be above 0 s, and at most 150 s",
        ),
        (
            "1,x,2,drag,5,0.3,0.04,-12,0.6,1,",
            "line 2: end_error_m = -12 m is out of range: it must be -10 m to 10 m",
        ),
        (
            "1,,2,drag,5,0.3,0.04,0,0.6,1,",
            "line 2: subject = `` is out of range: it must not be empty",
        ),
    ] {
        let error = read::<FittsTrial>(format!("{ELSEWHERE}{row}\n").as_bytes()).expect_err(row);
        assert_eq!(error.to_string(), message);
    }
    let error = read::<FittsTrial>(&b"subject,block\n1,2\n"[..]).expect_err("columns are missing");
    let message = "no column `resistance`, `condition`, `trial`, `amplitude_m`, `width_m`, `end_error_m`, \
                   `movement_time_s`, `errors`";
    assert_eq!(error.to_string(), message);
    for (bytes, message) in [
        (&b""[..], "it is empty: its first line must name the columns"),
        (b"PK\0\0\x08", "neither a table of text nor of Parquet"),
    ] {
        let error = read::<FittsTrial>(bytes).expect_err(message);
        assert_eq!(error.to_string(), message);
    }
    let in_mm = ELSEWHERE.replace("width_m", "width_mm");
    let error = read::<FittsTrial>(in_mm.as_bytes()).expect_err("another unit");
    let message = "no column `width_m` (but `width_mm`: convert it to m)";
    assert_eq!(error.to_string(), message);
}

#[test]
fn a_table_of_any_program_is_read_as_the_same_trials() {
    let plain = "subject,case,method,trial,base_static_N,base_dynamic_N,comparison_static_N,comparison_dynamic_N,level_N,\
                 comparison_first,answer,correct\nM\u{fc}ller,A,constant,1,4.25,3.5,5,4.5,1,true,1,true\n\
                 M\u{fc}ller,C,constant,2,4.25,3.5,3,2.5,1,false,1,false\n";
    let trials = read::<PerceptionTrial>(plain.as_bytes()).expect("trials");
    let same = |bytes: &[u8], what: &str| {
        let read = read::<PerceptionTrial>(bytes).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(read, trials, "{what}");
    };
    let quoted = plain.replace(',', "\",\"").replace('\n', "\"\n\"");
    same(
        format!("\"{}", quoted.trim_end_matches('"')).as_bytes(),
        "quotes, as R writes",
    );
    same(
        plain.replace(',', ";").replace('.', ",").as_bytes(),
        "a German spreadsheet",
    );
    same(plain.replace(',', "\t").as_bytes(), "tabs");
    for (yes, no) in [("TRUE", "FALSE"), ("True", "False"), ("1", "0")] {
        let other = plain.replace("true", yes).replace("false", no);
        same(other.as_bytes(), yes);
    }
    let utf_16: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    same(&[b"\xff\xfe", &utf_16[..]].concat(), "UTF-16");
    let latin: Vec<u8> = plain
        .chars()
        .map(|letter| u8::try_from(letter).expect("Latin-1"))
        .collect();
    same(&latin, "Latin-1");
    let error = read::<PerceptionTrial>(plain.replace(",true\n", ",perhaps\n").as_bytes()).expect_err("no truth");
    let message = "line 2: correct = `perhaps`: it must be true or false, or 1 or 0";
    assert_eq!(error.to_string(), message);
}
