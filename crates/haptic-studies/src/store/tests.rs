use super::super::run::{Progress, run};
use super::super::small_plans::{small_fitts, small_perception};
use super::super::subject::numbered_codes;
use super::*;
use std::collections::BTreeMap;

/// Makes a study of two simulated subjects.
fn create(folder: &Path, text: &str, seed: u64, recordings: bool) -> Result<Study, StoreError> {
    create_for(
        folder,
        text,
        seed,
        recordings,
        &SubjectTable::of_codes(&numbered_codes(2)),
    )
}

fn create_for(
    folder: &Path,
    text: &str,
    seed: u64,
    recordings: bool,
    subjects: &SubjectTable,
) -> Result<Study, StoreError> {
    let plan = Plan::read(text).expect("a plan");
    let about = StudyDescription::simulated(&plan, text, seed, subjects, recordings);
    Study::create(folder, text, &about, subjects)
}

/// Every file of a folder, by its path in it.
fn relative(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = PathBuf::from(path.file_name().expect("a name"));
        if path.is_dir() {
            let inside = relative(&path).into_iter();
            found.extend(inside.map(|(inner, bytes)| (name.join(inner), bytes)));
        } else {
            found.insert(name, fs::read(&path).expect("a file"));
        }
    }
    found
}

#[test]
fn closed_study_is_free_though_its_lock_file_is_inherited() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let text = small_fitts();
    let study = create(&folder, &text, 1, false).expect("created");
    let inherited = study._lock.0.try_clone().expect("a descriptor");
    assert!(matches!(Study::open(&folder), Err(StoreError::Locked(_))));
    drop(study);
    drop(Study::open(&folder).expect("it is free"));
    drop(inherited);
}

#[test]
fn a_study_keeps_its_subjects_orders_and_fields() {
    let parent = tempfile::tempdir().expect("a folder");
    let text = small_fitts();
    let plan = Plan::read(&text).expect("a plan");
    let names = plan.ordered_names();
    let table = |order: &str| {
        let text = format!("subject,order,handedness\nP1,{order},left\nP2,,right\n");
        SubjectTable::read(text.as_bytes()).expect("a table")
    };
    let create = |name: &str, subjects: &SubjectTable| {
        let about = StudyDescription::people(&plan, &text, 1, subjects);
        Study::create(&parent.path().join(name), &text, &about, subjects)
    };
    let subjects = table(&format!("{} | {}", names[1], names[0]));
    let study = create("study", &subjects).expect("created");
    let found: Vec<Subject> = study.subjects().collect();
    assert_eq!((&found[0].order[0], found[1].order.len()), (&names[1], 0));
    assert_eq!(super::subjects(study.folder()).expect("a table"), subjects);
    let error = create("wrong", &table(&format!("{0} | {0}", names[0]))).expect_err("twice");
    let message = format!(
        "subject P1: order = `{0} | {0}` is not a permutation of `{0} | {1}`",
        names[0], names[1]
    );
    assert_eq!(error.to_string(), message);
    assert!(!parent.path().join("wrong").exists());
}

#[test]
fn threads_change_nothing_and_nothing_is_overwritten() {
    let parent = tempfile::tempdir().expect("a folder");
    let [one, two] = ["one", "two"].map(|name| parent.path().join(name));
    for (text, threads) in [(small_fitts(), [1, 2]), (small_perception(), [2, 1])] {
        for (folder, threads) in [&one, &two].into_iter().zip(threads) {
            let study = create(folder, &text, 1, true).expect("created");
            run(&study, threads, &Progress::default()).expect("run");
        }
        let done = relative(&one);
        assert!(
            done.contains_key(Path::new("trials.parquet")) && done.len() > 9,
            "{:?}",
            done.keys()
        );
        assert!(done == relative(&two));
        let resumed = format!(
            "study resume {}`, in the panel with Open study",
            haptic_ipc::quoted(&one)
        );
        for (seed, message) in [
            (1, &*resumed),
            (
                2,
                "there is another study already, which differs in seed; nothing is overwritten",
            ),
        ] {
            let error = create(&one, &text, seed, true).expect_err("it is there").to_string();
            assert!(error.ends_with(message), "{error}");
        }
        let study = Study::open(&one).expect("opened");
        let progress = Progress::default();
        run(&study, 1, &progress).expect("nothing is left");
        assert_eq!(progress.trials(), 0);
        assert!(relative(&one) == done, "a study that is done stays as it is");
        for folder in [&one, &two] {
            fs::remove_dir_all(folder).expect("removed");
        }
    }
}

/// As if all had taken part from the start: in random orders and those of a square, and those that a table gave.
#[test]
fn subjects_added_later_give_the_study_of_all_from_the_start() {
    let parent = tempfile::tempdir().expect("a folder");
    let square = |text: String| text.replacen("order = \"random\"", "order = \"latin-square\"", 1);
    assert_ne!(square(small_fitts()), small_fitts());
    let names = Plan::read(&small_fitts()).expect("a plan").ordered_names();
    let order = format!("{} | {}", names[1], names[0]);
    let tables = [
        SubjectTable::of_codes(&numbered_codes(4)),
        SubjectTable::read(format!("subject,order,age\nP1,,20\nP2,,\nP3,{order},\nP4,,30\n").as_bytes())
            .expect("a table"),
        SubjectTable::read(format!("subject,order\nP1,{order}\nP2,\nP3,\nP4,{order}\n").as_bytes()).expect("a table"),
    ];
    let [plain, with_fields, with_orders] = &tables;
    for (number, (text, all)) in [
        (square(small_fitts()), plain),
        (small_fitts(), with_fields),
        (square(small_fitts()), with_orders),
        (small_perception(), plain),
    ]
    .into_iter()
    .enumerate()
    {
        let make = |name: String, subjects: &SubjectTable| {
            let study = create_for(&parent.path().join(name), &text, 5, number == 0, subjects).expect("created");
            run(&study, 2, &Progress::default()).expect("run");
            study
        };
        let whole = relative(make(format!("{number} all"), all).folder());
        for first in 1..test_run::extent(3, 4) {
            let [mut before, mut later] = [all.clone(), all.clone()];
            later.rows.drain(..first);
            before.rows.truncate(first);
            let mut study = make(format!("{number} {first}"), &before);
            let begun = relative(study.folder());
            study.add(&later).expect("added");
            let changed = ["study.json", "subjects.csv"];
            let added = relative(study.folder());
            assert_eq!(added.len(), begun.len());
            for (path, bytes) in &begun {
                assert!(
                    added[path] == *bytes || changed.iter().any(|name| path == Path::new(name)),
                    "{path:?}"
                );
            }
            run(&study, 2, &Progress::default()).expect("run");
            let found = relative(study.folder());
            assert!(found.keys().eq(whole.keys()), "{:?}", found.keys());
            for (path, bytes) in &found {
                assert!(whole[path] == *bytes, "study {number} of {first} and others: {path:?}");
            }
        }
    }
}

#[test]
fn added_subjects_need_new_codes_and_the_plans_orders() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let text = small_fitts();
    let mut study = create(&folder, &text, 1, false).expect("created");
    // What people write into the table stays, also of a subject who is added after it.
    let written = "subject;handedness\n01;left\n03;right\n";
    fs::write(folder.join("subjects.csv"), written).expect("written");
    let begun = relative(&folder);
    for (rows, message) in [
        ("02", "subject `02`: duplicate code (case is ignored)"),
        ("03\n03", "subject `03`: duplicate code (case is ignored)"),
        ("a b", "subject `a b`: a code has 1 to 32 letters"),
        ("03,golf", "subject 03: order = `golf` is not a permutation"),
    ] {
        let heading = if rows.contains(',') { "subject,order" } else { "subject" };
        let table = SubjectTable::read(format!("{heading}\n{rows}\n").as_bytes()).expect("a table");
        let error = study.add(&table).expect_err(message).to_string();
        assert!(error.starts_with(message), "{error}");
        assert!(relative(&folder) == begun);
    }
    let more = SubjectTable::read(b"subject,age\n03,20\n04,30\n").expect("a table");
    study.add(&more).expect("added");
    let table = fs::read_to_string(folder.join("subjects.csv")).expect("a table");
    assert_eq!(table, "subject,handedness,age\n01,left,\n03,right,\n04,,30\n");
    assert_eq!(read(&folder).expect("a study").1, *study.about());
    assert_eq!(study.about().subjects, numbered_codes(4));

    // Who asks for more subjects than there are is told how to add them.
    let [two, six] = [2, 6].map(|subjects| SubjectTable::of_codes(&numbered_codes(subjects)));
    let create = |seed, subjects| {
        let error = create_for(&folder, &text, seed, false, subjects).expect_err("taken");
        error.to_string()
    };
    let adds = format!("; `haptic-ctl study add {} --codes 05,06` adds 05, 06", quoted(&folder));
    for (error, end) in [
        (create(1, &six), &*adds),
        (create(1, &two), "nothing is overwritten"),
        (create(2, &six), "nothing is overwritten"),
    ] {
        assert!(error.ends_with(end), "{error}");
    }
}

/// The rows up to any byte, as a program that was killed leaves them, lead to the same study. What was recorded of a
/// trial without a row stays.
#[test]
fn a_row_that_was_cut_off_is_done_again() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let study = create(&folder, &small_fitts(), 3, true).expect("created");
    run(&study, 1, &Progress::default()).expect("run");
    drop(study);
    let whole = relative(&folder);
    let session = folder.join("data/subject-02/session-01");
    let data = session.join("subject-02_session-01_task-fitts_data.csv");
    let bytes = fs::read(&data).expect("rows");
    let header = bytes.iter().position(|byte| *byte == b'\n').expect("a header");
    let cuts = [0, header / 2, header + 1, header + 40, bytes.len() / 2, bytes.len() - 1];
    for cut in &cuts[..test_run::extent(4, cuts.len())] {
        fs::write(&data, &bytes[..*cut]).expect("cut");
        fs::remove_file(folder.join("trials.parquet")).expect("it was done");
        let found = trials::<FittsTrial>(&folder).expect("read while it is under way");
        assert!(found.len() < 24, "{}", found.len());
        let (plan, about) = read(&folder).expect("a study");
        assert_eq!(unfinished(&folder, &plan, &about), Some((found.len(), Some(24))));
        // One that was not whole, of the trial whose row comes next.
        let next = session.join(format!("recordings/trial-{:04}", found.len() - 12 + 1));
        fs::write(next.with_extension("part.mcap"), "begun").expect("written");
        run(&Study::open(&folder).expect("opened"), 1, &Progress::default()).expect("run");
        let [begun, done] = ["unscored-1.mcap", "unscored-2.mcap"].map(|ending| {
            let path = next.with_extension(ending);
            let bytes = fs::read(&path).expect("it is set aside");
            fs::remove_file(path).expect("removed");
            bytes
        });
        assert!(begun == b"begun" && done == fs::read(next.with_extension("mcap")).expect("a recording"));
        assert!(relative(&folder) == whole, "cut at {cut}");
        assert_eq!(unfinished(&folder, &plan, &about), None);
    }
}

#[test]
fn what_is_not_this_study_is_refused() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let text = small_fitts();
    let error = Study::open(&folder).expect_err("none").to_string();
    assert!(error.ends_with("there is no study: it has no study.json"), "{error}");
    let study = create(&folder, &text, 3, false).expect("created");
    let progress = Progress::default();
    progress.stop();
    run(&study, 1, &progress).expect("stopped");
    drop(study);
    let (plan, description) = read(&folder).expect("a study");
    assert_eq!(unfinished(&folder, &plan, &description), Some((0, Some(24))));
    assert!(!folder.join("data").exists(), "reading makes nothing");
    fs::write(folder.join("plan.toml"), text.replace("rest_s = 60", "rest_s = 61")).expect("written");
    let error = Study::open(&folder).expect_err("another plan").to_string();
    assert!(
        error.contains("plan.toml: the plan was changed since the study began")
            && error.ends_with("; put the old plan back, or make a new study"),
        "{error}"
    );
    let other = parent.path().join("other");
    fs::create_dir(&other).expect("created");
    fs::write(other.join("thesis.tex"), "mine").expect("written");
    let error = create(&other, &text, 3, false).expect_err("taken").to_string();
    assert!(
        error.ends_with("not an empty folder; nothing is overwritten"),
        "{error}"
    );
    assert_eq!(fs::read_dir(&other).expect("a folder").count(), 1);
}
