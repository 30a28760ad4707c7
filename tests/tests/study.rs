//! `haptic-ctl study`: a whole study by simulated operators, killed and resumed.

use rustix::process::Signal;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use system_tests::{binary, ctl, ctl_offline, ctl_offline_refused, is_refused, plain, process, stderr, text};

/// The program's own targeting task, of two conditions, two resistances and so many trials a segment.
pub(crate) fn small_plan(folder: &Path, trials: u32) -> PathBuf {
    let plan = text(&ctl_offline(&["study", "plan", "fitts"]).stdout);
    let plan = plan.replace("trials_per_segment = 8", &format!("trials_per_segment = {trials}"));
    let (head, rest) = plan
        .split_once("[[conditions]]\nname = \"3\"")
        .expect("a third condition");
    let (_, resistances) = rest.split_once("[[resistances]]").expect("resistances");
    let (two, _) = resistances.split_once("# 0.5 kg with").expect("a third resistance");
    let path = folder.join("small.toml");
    fs::write(&path, format!("{head}[[resistances]]{two}")).expect("written");
    path
}

fn study(plan: &str, out: &Path, more: &[&str]) -> Vec<String> {
    let two = ["--operator=simulated", "--subjects=2", "--seed=4"];
    let basic = ["study", "run", plan, two[0], two[1], two[2], "--out", plain(out)];
    [&basic, more].concat().into_iter().map(str::to_owned).collect()
}

fn run(arguments: &[String]) -> Output {
    ctl(
        Path::new("/nonexistent"),
        &arguments.iter().map(String::as_str).collect::<Vec<_>>(),
    )
}

fn start(arguments: &[String]) -> Child {
    Command::new(binary("haptic-ctl"))
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// The files of a folder, by their paths in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("an entry").path();
        let name = PathBuf::from(path.file_name().expect("a name"));
        if path.is_dir() {
            found.extend(files(&path).into_iter().map(|(inner, bytes)| (name.join(inner), bytes)));
        } else if let Ok(bytes) = fs::read(&path) {
            found.insert(name, bytes);
        }
    }
    found
}

#[test]
fn subjects_are_added_to_a_study_by_the_command_that_it_names() {
    let parent = tempfile::tempdir().expect("a folder");
    let plan = small_plan(parent.path(), 1);
    let [early, late] = ["early", "late"].map(|name| parent.path().join(name));
    let subjects = |folder: &Path, count: &str| {
        let mut arguments = study(plain(&plan), folder, &["--no-recordings"]);
        arguments[4] = format!("--subjects={count}");
        run(&arguments)
    };
    assert!(subjects(&early, "4").status.success());
    assert!(subjects(&late, "2").status.success());
    let command = format!("`haptic-ctl study add {} --codes 03,04` adds 03, 04\n", plain(&late));
    is_refused("4", &subjects(&late, "4"), 2, &[&command]);
    for (count, message) in [
        ("1", "--subjects 1: the study has 2 subjects: 01, 02; N is"),
        ("0", "1..=999"),
    ] {
        ctl_offline_refused(&["study", "add", plain(&late), "--subjects", count], 2, &[message]);
    }
    let added = text(&ctl_offline(&["study", "add", plain(&late), "--subjects", "4"]).stdout);
    let first = format!(
        "a study by simulated operators: 01, 02, 03, 04. Continue with `haptic-ctl study resume {}`",
        plain(&late)
    );
    assert!(added.contains(&first) && added.contains("\n04: "), "{added}");
    let resumed = text(&ctl_offline(&["study", "resume", plain(&late)]).stdout);
    assert!(resumed.contains("The study is finished."), "{resumed}");
    assert!(files(&late) == files(&early));

    // Where a table gave orders, a table gives those of the new ones.
    let people = parent.path().join("people");
    let table = |name: &str, rows: &str| {
        let path = parent.path().join(name);
        fs::write(&path, format!("subject,order\n{rows}\n")).expect("written");
        path.display().to_string()
    };
    let [first, more] = [
        table("first.csv", "P1,real | baseline"),
        table("more.csv", "P2,baseline | real"),
    ];
    let new = [
        "study",
        "new",
        plain(&plan),
        "--out",
        plain(&people),
        "--subjects-file",
        &first,
    ];
    drop(ctl_offline(&new));
    let add = ["study", "add", plain(&people)];
    ctl_offline_refused(
        &[&add[..], &["--codes", "P2"]].concat(),
        2,
        &["--subjects-file must name the new ones"],
    );
    let added = text(&ctl_offline(&[&add[..], &["--subjects-file", &more]].concat()).stdout);
    assert!(added.contains("P1: real | baseline\nP2: baseline | real\n"), "{added}");
}

#[test]
fn a_plan_that_the_analysis_cannot_use_is_refused_or_noted() {
    let parent = tempfile::tempdir().expect("a folder");
    let plan = text(&ctl_offline(&["study", "plan", "perception"]).stdout);
    let path = parent.path().join("levels.toml");
    let levels = |levels: &str| {
        let text = plan.replace("[0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0]", levels);
        fs::write(&path, text).expect("written");
        ["study", "plan", plain(&path)]
    };
    ctl_offline_refused(
        &levels("[0.3]"),
        2,
        &["levels_N: different levels: 1; the analysis needs at least 3"],
    );
    ctl_offline_refused(&levels("[0.3, 0.3, 0.5]"), 2, &["levels_N: 0.3 N is there twice"]);
    let noted = stderr(&ctl_offline(&levels("[30, 100, 300]")));
    assert!(
        noted.contains("is a valid plan") && noted.contains("is it meant in N?"),
        "{noted}"
    );
}

/// Bytes of rows.
fn rows(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| match entry.path() {
            path if is_table(&path) => entry.metadata().map_or(0, |file| file.len()),
            path if path.file_name().is_some_and(|name| name != "recordings") => rows(&path),
            _ => 0,
        })
        .sum()
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "csv")
}

#[test]
fn interrupt_ends_study_cleanly_and_second_program_is_refused() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let mut program = start(&study("perception", &folder, &["--no-recordings"]));
    let mut until_rows_in = |folder: &Path| {
        while rows(folder) == 0 {
            assert!(program.try_wait().expect("a state").is_none(), "it ended by itself");
            std::thread::yield_now();
        }
        program.id()
    };
    // Paused as soon as its folder can be found: a busy machine may start a program later than the study ends.
    let id = until_rows_in(&folder);
    process::signal(id, Signal::STOP);
    let second = ["study", "resume", plain(&folder)];
    ctl_offline_refused(&second, 2, &["another program is running this study\n"]);
    process::signal(id, Signal::CONT);
    until_rows_in(&folder.join("data"));
    let ended = process::end(program, Signal::INT);
    assert_eq!(ended.status.code(), Some(130), "{}", stderr(&ended));
    let printed = text(&ended.stdout);
    assert!(
        printed.contains("The study is interrupted; continue with `haptic-ctl study resume "),
        "{printed}"
    );
    let written = files(&folder);
    assert!(!written.contains_key(Path::new("trials.parquet")));
    for (path, bytes) in written.iter().filter(|(path, _)| is_table(path)) {
        assert!(bytes.ends_with(b"\n"), "{} ends within a row", path.display());
    }
}

#[test]
fn a_wrong_study_is_refused_with_the_reason() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    for (arguments, message) in [
        (
            vec!["study", "run", "fitts", "--subjects", "2", "--out", plain(&folder)],
            "--operator simulated is needed",
        ),
        (
            vec![
                "study",
                "run",
                "golf",
                "--operator=simulated",
                "--subjects=2",
                "--out",
                plain(&folder),
            ],
            "golf: No such file or directory (os error 2); the program's own plans are fitts and perception",
        ),
        (vec!["study", "resume", plain(&folder)], "there is no study"),
    ] {
        ctl_offline_refused(&arguments, 2, &[message]);
    }
    assert!(!folder.exists(), "nothing was made");
}

#[test]
fn human_study_is_made_by_one_command_and_reported_as_human() {
    let parent = tempfile::tempdir().expect("a folder");
    let plan = small_plan(parent.path(), 1);
    let (people, model) = (parent.path().join("people"), parent.path().join("model"));
    let offline = |arguments: &[&str]| ctl(Path::new("/nonexistent"), arguments);
    let new = |more: &[&str]| offline(&[&["study", "new", plain(&plan), "--out", plain(&people)], more].concat());
    is_refused(
        "P1,p1",
        &new(&["--codes", "P1,p1"]),
        2,
        &["subject `p1`: duplicate code (case is ignored)"],
    );
    let made = new(&["--codes", "P1,P2"]);
    assert!(made.status.success(), "{}", stderr(&made));
    assert!(
        text(&made.stdout).contains("haptic-gui --page task --study "),
        "{}",
        text(&made.stdout)
    );
    assert!(!new(&["--subjects", "2"]).status.success(), "nothing is overwritten");
    let run_by_people = ["study", "run", "fitts", "--subjects", "2", "--out", "Ada's x"];
    let command = r"haptic-ctl study new fitts --subjects 2 --out 'Ada'\''s x'";
    ctl_offline_refused(&run_by_people, 2, &[command]);

    // Two rows of a model, as if people had done them.
    let done = run(&study(plain(&plan), &model, &["--no-recordings"]));
    assert!(done.status.success(), "{}", stderr(&done));
    let table = |folder: &Path, code: &str| {
        folder.join(format!(
            "data/subject-{code}/session-01/subject-{code}_session-01_task-fitts_data.csv"
        ))
    };
    let rows = fs::read_to_string(table(&model, "01")).expect("rows");
    let of_people = rows.replace("simulated,01,", "human,P1,");
    fs::create_dir_all(table(&people, "P1").parent().expect("a folder")).expect("made");
    fs::write(table(&people, "P1"), &of_people).expect("written");
    let analyse = || offline(&["study", "analyse", plain(&people), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&analyse().stdout).expect("JSON");
    assert_eq!(found["operator"], "human");
    assert!(!found["notes"].to_string().contains("model"), "{}", found["notes"]);
    fs::write(table(&people, "P1"), of_people.replacen("human", "simulated", 1)).expect("written");
    is_refused("mixed", &analyse(), 2, &["more than one kind of operator"]);

    // Practice is missing, so the rows are not those of the plan from its beginning.
    let resumed = offline(&["study", "resume", plain(&people)]);
    assert!(stderr(&resumed).contains("subject P1"), "{}", stderr(&resumed));
    fs::remove_dir_all(people.join("data")).expect("removed");
    fs::write(people.join("trials.parquet"), "rows of one who has withdrawn").expect("written");
    let resumed = offline(&["study", "resume", plain(&people)]);
    let printed = text(&resumed.stdout);
    assert!(
        printed.contains("subject P1: 0 of ") && printed.contains("people do this study"),
        "{printed}"
    );
    assert!(!people.join("trials.parquet").exists(), "nothing of a subject is kept");
}
