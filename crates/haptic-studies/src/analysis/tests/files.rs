//! Tables, figures and pages of an analysis.

use super::*;
use crate::subject_table::SubjectRow;

#[test]
fn the_files_have_every_table_and_every_figure() {
    let mut found = analysed(&study());
    found.put_beside_paper(&fitts_plan());
    let tables = fitts_tables(&found, TERMINAL);
    let names: Vec<&str> = tables.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "throughput",
            "table-3-time",
            "table-4-errors",
            "table-5-error-size",
            "pairs",
            "beside-paper",
            "difficulty"
        ]
    );
    let times = &tables[1].1.rows;
    assert_eq!(times[1], ["easy", "3.000", "2/0", "0/1"]);
    assert_eq!(times[3], ["sum", "", "3/0", "1/2"]);
    let files = files_of(&found);
    let text = |name: &str| text_of(&files, name);
    assert!(
        text("table-3-time.md")
            .contains("| condition | ID bit | real | viscous |\n|:--|--:|--:|--:|\n| easy | 3.000 |")
    );
    assert!(text("table-3-time.tex").contains("easy & 3.000 & 2/0 & 0/1 \\\\\n"));
    assert!(text("differences.csv").starts_with(
        "operator,subject,resistance,condition,difficulty_bit,time_s,errors,error_size_m\n,a,real,easy,3"
    ));
    assert!(text("difficulty.svg").contains("Movement time against") && text("quadrants-size.svg").contains("viscous"));
    // Two conditions give no line, and each resistance says so.
    assert!(text("difficulty.svg").contains(">real has no line: points of the regression: 2; at least 3 are needed<"));
    assert!(
        !files.iter().any(|(name, _)| name == "trajectories.svg"),
        "there are no recordings"
    );
    let page = text("analysis.html");
    for part in [
        "Table 3",
        "real: time against errors",
        "viscous: time against size",
        "Movement time against",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn bars_of_one_condition_stand_beside_one_another() {
    let files = files_of(&analysed(&study()));
    // The discs of the plot have their bars before them; those of the legend have none.
    let places: Vec<&str> = text_of(&files, "difficulty.svg")
        .split("<circle")
        .skip(1)
        .filter_map(|disc| disc.split_once("cx=\"")?.1.split('"').next())
        .collect();
    let distinct: std::collections::BTreeSet<&&str> = places.iter().collect();
    assert_eq!(distinct.len(), places.len(), "{places:?}");
}

#[test]
fn tables_that_pool_two_blocks_of_the_baseline_say_so() {
    let pooled = |trials: &[FittsTrial]| -> Vec<String> {
        let files = files_of(&analysed(trials));
        let has_note = |bytes: &[u8]| String::from_utf8_lossy(bytes).contains("baseline is the baseline");
        let tables = files.into_iter().filter(|(name, _)| !name.ends_with(".html"));
        tables
            .filter(|(_, bytes)| has_note(bytes))
            .map(|(name, _)| name)
            .collect()
    };
    let of_both = ["throughput.md", "throughput.tex", "difficulty.md", "difficulty.tex"];
    assert_eq!(pooled(&study()), of_both);
    let once: Vec<FittsTrial> = study().into_iter().filter(|trial| trial.block != 1).collect();
    assert!(pooled(&once).is_empty());
}

#[test]
fn errors_are_counted_by_whole_ones() {
    let mut found = analysed(&study());
    found
        .differences
        .iter_mut()
        .for_each(|one| (one.errors, one.time_s) = (0.0, 30.0));
    let files = files_of(&found);
    let pictures = || files.iter().filter(|(name, _)| name.starts_with("quadrants-errors"));
    assert!(pictures().count() > 0);
    for (name, picture) in pictures() {
        let picture = String::from_utf8_lossy(picture);
        assert!(
            picture.contains(">2<") && !picture.contains(".5<") && !picture.contains(".2<"),
            "{name}: {picture}"
        );
    }
}

#[test]
fn notes_of_a_latex_table_say_each_reason_once() {
    let found = twice(&[(0.1, 15), (0.3, 20), (1.2, 20)]);
    let files = perception_files(&found, &SubjectTable::default(), "Cases");
    let notes = |name: &str| -> Vec<&str> {
        let notes = text_of(&files, name)
            .split("\\footnotesize\n")
            .last()
            .expect("notes")
            .split('\n');
        notes
            .take_while(|line| !line.starts_with("\\end"))
            .map(|line| line.trim_end_matches("\\\\"))
            .collect()
    };
    let reason = "the threshold is at the lowest tested level, 0.1, or below it";
    let pooled = format!("{reason}: A constant, pooled");
    let own = format!("--: {reason}: A constant, 01; A constant, 02");
    let none = "no staircase: A constant";
    assert_eq!(
        notes("jnd.tex"),
        ["--: no subject's threshold is determined: A constant", &*pooled, none]
    );
    assert_eq!(notes("subjects.tex"), [&*own, none]);
    let page = text_of(&files, "jnd.md");
    let below = format!("|\n\n-: no subject's threshold is determined: A constant\n\n{pooled}\n\n{none}\n");
    assert!(page.ends_with(&below), "{page}");
}

#[test]
fn star_of_a_sign_test_is_explained_below_its_latex_table() {
    let of_subject = |code: &str| {
        let baseline = segment((code, 1, "baseline", "easy"), [1.0, 1.0], (0, 0.0));
        [baseline, segment((code, 2, "real", "easy"), [0.7, 0.7], (0, 0.0))].concat()
    };
    // All of six are better by chance in one of 32 studies.
    let trials: Vec<FittsTrial> = ["a", "b", "c", "d", "e", "f"]
        .into_iter()
        .flat_map(of_subject)
        .collect();
    let files = files_of(&analysed(&trials));
    let text = |name: &str| text_of(&files, name);
    let explained = |name: &str| text(name).contains("{*}: p \\textless{} 0.05, sign test");
    assert!(text("table-3-time.tex").contains("6/0{*}") && explained("table-3-time.tex"));
    assert!(!explained("table-4-errors.tex"), "no star, no note");
}

#[test]
fn every_file_of_a_simulated_operator_says_so() {
    let mut trials = study();
    let mut answers = answers(
        "01",
        Case::A,
        Method::Constant,
        &[(0.1, true, false), (0.3, false, false), (0.5, true, false)],
    );
    for operator in [None, Some(Operator::Human), Some(Operator::Simulated)] {
        trials.iter_mut().for_each(|trial| trial.operator = operator);
        answers.iter_mut().for_each(|trial| trial.operator = operator);
        let thresholds = perception(&answers, None, 1).expect("an analysis");
        let files = [
            files_of(&analysed(&trials)),
            perception_files(&thresholds, &SubjectTable::default(), "Cases"),
        ];
        for (name, bytes) in files.concat() {
            let text = String::from_utf8(bytes).expect("text");
            let says_so = match name.rsplit('.').next() {
                Some("csv") => text.lines().skip(1).all(|row| row.starts_with("simulated,")),
                _ => text.contains("simulated operator, not people"),
            };
            // A table without a row says nothing.
            let is_empty = text.lines().count() == 1;
            let is_simulated = operator == Some(Operator::Simulated);
            assert!(is_empty || says_so == is_simulated, "{operator:?} {name}:\n{text}");
        }
    }
}

/// The columns of a table, each by its name. A name that is there twice fails.
fn columns(table: &haptic_lab::drawing::Table) -> std::collections::BTreeMap<String, Vec<String>> {
    let mut reader = csv::Reader::from_reader(std::io::Cursor::new(table.csv()));
    let heading = reader.headers().expect("a heading").clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("as many cells")).collect();
    let mut columns = std::collections::BTreeMap::new();
    for (place, name) in heading.iter().enumerate() {
        let cells = rows.iter().map(|row| row[place].to_owned()).collect();
        assert!(
            columns.insert(name.to_owned(), cells).is_none(),
            "{name} is there twice"
        );
    }
    columns
}

#[test]
fn tidy_tables_have_each_column_once_and_every_digit() {
    let found = analysed(&study());
    let answers = answers(
        "01",
        Case::A,
        Method::Constant,
        &[(0.1, true, false), (0.3, false, false)],
    );
    let thresholds = perception(&answers, None, 1).expect("an analysis");
    let row = |code: &str, age: &str| SubjectRow {
        code: code.to_owned(),
        order: Vec::new(),
        values: vec![age.to_owned(), String::new()],
    };
    let subjects = SubjectTable {
        fields: vec!["age".to_owned(), "block".to_owned()],
        rows: vec![row("b", "30-39"), row("01", "20-29")],
    };
    let tables = [fitts_data(&found, &subjects), perception_data(&thresholds, &subjects)].concat();
    let all: std::collections::BTreeMap<_, _> = tables.iter().map(|(name, table)| (&**name, columns(table))).collect();
    assert_eq!(all.len(), tables.len());
    let numbers = |table: &str, column: &str| -> Vec<Option<f64>> {
        let cells = all[table][column].iter();
        cells
            .map(|cell| (!cell.is_empty()).then(|| cell.parse().expect(cell)))
            .collect()
    };
    let exact = |values: Vec<Option<f64>>, table: &str, column: &str| {
        let bits = |values: Vec<Option<f64>>| values.into_iter().map(|one| one.map(f64::to_bits)).collect::<Vec<_>>();
        assert_eq!(bits(numbers(table, column)), bits(values), "{table}: {column}");
    };
    let sequences = found.sequences.iter();
    let sequences = sequences.map(|one| Some(one.throughput.throughput_bit_per_s)).collect();
    exact(sequences, "sequences", "throughput_bit_per_s");
    let interval = |end: usize| {
        let means = found.by_resistance.iter().chain(&found.overall);
        means
            .map(|one| one.throughput_interval_bit_per_s.map(|ends| ends[end]))
            .collect()
    };
    exact(interval(0), "throughput", "throughput_low_bit_per_s");
    exact(interval(1), "throughput", "throughput_high_bit_per_s");
    // Neither two conditions nor two levels determine anything: the cells are empty, and the reason is beside them.
    exact(vec![None; 3], "difficulty", "slope_low_s_per_bit");
    exact(vec![None], "jnd", "pooled_N");
    assert!(all["jnd"]["pooled_refused"][0].contains("levels: 2"), "{all:?}");
    assert_eq!(all["subjects"]["subject_age"], ["20-29"]);
    let of_subjects = &all["differences"];
    for (code, age) in of_subjects["subject"].iter().zip(&of_subjects["subject_age"]) {
        assert_eq!(age, if code == "b" { "30-39" } else { "" });
    }
    // A cell has one value: no interval, no ratio, no star.
    for (name, columns) in &all {
        let columns = columns.iter().filter(|(column, _)| !column.ends_with("refused"));
        for cell in columns.flat_map(|(_, cells)| cells) {
            let is_word = cell.is_empty() || cell.starts_with(|first: char| first.is_ascii_alphabetic());
            let is_value = cell.parse::<f64>().is_ok() || cell == "30-39" || cell == "20-29";
            assert!(is_word || is_value, "{name}: {cell}");
        }
    }
}
