//! The commands of the documents' pages, run as a reader runs them.
//!
//! A page has them in fenced blocks of the kind `console`. A line that begins with `$ ` is a command, and goes on in
//! the next line where it ends with `\`; the lines below it are what it prints, errors included. `...` within a line
//! stands for any text, and a line `...` for any lines. A remark directly above a block says what is special about
//! it:
//!
//! | remark | effect |
//! |---|---|
//! | `<!-- file: NAME -->` | the block, of any kind, is what the file NAME in the reader's folder holds |
//! | `<!-- keeps running -->` | the command runs in a terminal of its own, to the end of the page |
//! | `<!-- typed into: NAME -->` | the lines of the block go to the standard input of the program NAME that keeps running |
//! | `<!-- exit code: N -->` | the command ends with N instead of 0 |
//! | `<!-- not run: WHY -->` | the commands are not run |
//!
//! `<!-- Ctrl-C: NAME -->`, anywhere, ends a program that keeps running. A page is followed in a folder of its own that
//! looks like a checkout of the repository, with a runtime directory and a home of its own.

use crate::process::{Killed, signal};
use crate::timed::count_missed;
use crate::{PATIENCE, be_patient, binary, pause};
use rustix::process::Signal;
use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// A command and what it prints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConsoleLine {
    /// As the shell takes it.
    pub command: String,
    /// Lines that it prints, with wildcards.
    pub prints: Vec<String>,
}

impl ConsoleLine {
    fn differs(&self, printed: &str) -> String {
        let shown = self.prints.join("\n");
        format!("`{}` is shown with\n{shown}\nand prints\n{printed}", self.command)
    }
}

/// What a page asks its reader to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// To write a file.
    Save {
        /// Its name in the reader's folder.
        name: String,
        /// What it holds.
        text: String,
    },
    /// To run commands one after the other.
    Run {
        /// The commands.
        lines: Vec<ConsoleLine>,
        /// Exit code of each.
        code: i32,
    },
    /// To start a program in a terminal of its own.
    Start(ConsoleLine),
    /// To type lines into a program that runs.
    Type {
        /// Its name.
        program: String,
        /// What is typed.
        lines: Vec<String>,
    },
    /// To end a program that runs.
    Interrupt(String),
}

/// Reads the steps of a page, each with the number of its first line.
pub fn steps(page: &str) -> Vec<(usize, Step)> {
    let mut steps = Vec::new();
    let mut remark = None;
    let mut lines = page.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        if let Some(kind) = line.strip_prefix("```") {
            let body: Vec<&str> = lines
                .by_ref()
                .map(|(line, _)| line)
                .take_while(|line| *line != "```")
                .collect();
            let step = step(kind, remark.take(), &body).unwrap_or_else(|why| panic!("line {number}: {why}"));
            steps.extend(step.map(|step| (number, step)));
        } else if let Some(text) = remark_of(line) {
            match text.strip_prefix("Ctrl-C: ") {
                Some(program) => steps.push((number, Step::Interrupt(program.to_owned()))),
                None => remark = Some(text),
            }
        } else {
            remark = None;
        }
    }
    steps
}

fn remark_of(line: &str) -> Option<&str> {
    line.strip_prefix("<!-- ")?.strip_suffix(" -->")
}

fn step(kind: &str, remark: Option<&str>, body: &[&str]) -> Result<Option<Step>, String> {
    let (what, value) = remark.map_or(("", ""), |remark| remark.split_once(": ").unwrap_or((remark, "")));
    let value = value.to_owned();
    if what == "file" {
        let text = body.join("\n") + "\n";
        return Ok(Some(Step::Save { name: value, text }));
    }
    if what == "typed into" {
        let lines = body.iter().map(|line| (*line).to_owned()).collect();
        return Ok(Some(Step::Type { program: value, lines }));
    }
    if kind != "console" {
        return Ok(None);
    }
    let mut lines = commands(body)?;
    match what {
        "keeps running" if lines.len() == 1 => Ok(Some(Step::Start(lines.remove(0)))),
        "keeps running" => Err("one program runs in a terminal".to_owned()),
        "not run" if value.is_empty() => Err("it says not why it is not run".to_owned()),
        "not run" => Ok(None),
        "exit code" => {
            let code = value.parse().map_err(|_| format!("`{value}` is not an exit code"))?;
            Ok(Some(Step::Run { lines, code }))
        }
        // Other remarks are the page's own.
        _ => Ok(Some(Step::Run { lines, code: 0 })),
    }
}

fn commands(body: &[&str]) -> Result<Vec<ConsoleLine>, String> {
    let mut lines: Vec<ConsoleLine> = Vec::new();
    let mut goes_on = false;
    for text in body {
        match (text.strip_prefix("$ "), lines.last_mut()) {
            (_, Some(last)) if goes_on => {
                last.command = format!("{}\n{text}", last.command);
                goes_on = text.ends_with('\\');
            }
            (Some(command), _) => {
                goes_on = command.ends_with('\\');
                lines.push(ConsoleLine {
                    command: command.to_owned(),
                    prints: Vec::new(),
                });
            }
            (None, Some(last)) => last.prints.push((*text).to_owned()),
            (None, None) => return Err(format!("the block begins with no command: {text}")),
        }
    }
    Ok(lines)
}

/// Whether lines are as a page shows them, wildcards considered. What stands at the end of a line does not count.
pub fn is_as_shown(shown: &[String], printed: &[&str]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((any, rest)) if any == "..." => (0..=printed.len()).any(|skipped| is_as_shown(rest, &printed[skipped..])),
        Some((line, rest)) => printed
            .split_first()
            .is_some_and(|(first, others)| is_line_as_shown(line, first) && is_as_shown(rest, others)),
    }
}

fn is_line_as_shown(shown: &str, printed: &str) -> bool {
    let (shown, printed) = (shown.trim_end(), printed.trim_end());
    let parts: Vec<&str> = shown.split("...").collect();
    let [first, middle @ .., last] = &parts[..] else {
        return shown == printed;
    };
    let Some(mut left) = printed.strip_prefix(first) else {
        return false;
    };
    for part in middle {
        let Some(at) = left.find(part) else { return false };
        left = &left[at + part.len()..];
    }
    left.ends_with(last)
}

/// A reader who follows a page.
pub struct Reader {
    folder: tempfile::TempDir,
    /// The programs that keep running, each with its command.
    running: Vec<(String, Killed)>,
}

impl Reader {
    /// A reader in a new folder.
    pub fn begin() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let root = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("..")
            .canonicalize()
            .expect("the repository");
        for name in ["docs", "examples", "firmware", "python", "scenes", "studies"] {
            symlink(root.join(name), folder.path().join(name)).expect("a link");
        }
        let programs = folder.path().join(".programs");
        for name in ["", "../.home", "../.run"] {
            fs::create_dir(programs.join(name)).expect("a folder");
        }
        for name in ["haptic-ctl", "fake-board", "fake-rig"] {
            symlink(binary(name), programs.join(name)).expect("a link");
        }
        // The daemon of a page that a busy machine follows may stand still for longer than that of a hand.
        let mut patient = Command::new(binary("hapticd"));
        be_patient(&mut patient);
        let options: Vec<&str> = patient.get_args().filter_map(|option| option.to_str()).collect();
        let mut script = String::from("#!/bin/sh\n");
        for option in options.chunks(2) {
            let (name, both) = (option[0], option.join(" "));
            script.push_str(&format!(
                "case \" $* \" in *\" {name} \"*) ;; *) set -- \"$@\" {both} ;; esac\n"
            ));
        }
        script.push_str(&format!("exec {} \"$@\"\n", binary("hapticd").display()));
        // By a process of its own: a program that this one is writing could be inherited, still open for writing, by
        // one that another test starts, and "text file busy" would keep it from being run.
        let text = programs.join("../.script");
        fs::write(&text, script).expect("it can be written");
        let mut install = Command::new("install");
        install.args(["-m", "755"]).args([&text, &programs.join("hapticd")]);
        assert!(install.status().is_ok_and(|status| status.success()), "install");
        Self {
            folder,
            running: Vec::new(),
        }
    }

    /// Does all that the page says.
    ///
    /// # Errors
    /// Where it goes otherwise than the page shows: the line, what is shown, and what came.
    pub fn follow(&mut self, page: &str) -> Result<(), String> {
        for (number, step) in steps(page) {
            if let Err(why) = self.take(step) {
                count_missed(&self.folder.path().join(".run/hapticd/control.sock"));
                return Err(format!("line {number}: {why}"));
            }
        }
        Ok(())
    }

    fn take(&mut self, step: Step) -> Result<(), String> {
        match step {
            Step::Save { name, text } => {
                fs::write(self.folder.path().join(name), text).map_err(|error| error.to_string())
            }
            Step::Run { lines, code } => lines.iter().try_for_each(|line| self.run(line, code)),
            Step::Start(line) => self.start(&line),
            Step::Type { program, lines } => self.type_into(&program, &lines),
            Step::Interrupt(program) => self.interrupt(&program),
        }
    }

    /// A shell as the reader has it. With `timeout` as its program it ends a command that hangs.
    fn shell(&self, program: &[&str], command: &str) -> Command {
        let path = |name: &str| self.folder.path().join(name);
        let mut shell = Command::new(program[0]);
        shell
            .args(&program[1..])
            .args(["-c", command])
            .current_dir(self.folder.path())
            .env_clear()
            .env(
                "PATH",
                format!("{}:/usr/local/bin:/usr/bin:/bin", path(".programs").display()),
            )
            .env("HOME", path(".home"))
            .env("XDG_RUNTIME_DIR", path(".run"))
            .env("PYTHONPATH", path("python/src"))
            .env("PYTHONDONTWRITEBYTECODE", "1");
        shell
    }

    fn run(&self, line: &ConsoleLine, code: i32) -> Result<(), String> {
        let text = format!("exec 2>&1; set -o pipefail; {}", line.command);
        // A study, or a soak, takes as long as the machine needs for it.
        let limit = (5 * PATIENCE).as_secs().to_string();
        let mut shell = self.shell(&["timeout", &limit, "bash"], &text);
        let output = shell.stdin(Stdio::null()).output().expect("bash starts");
        let printed = String::from_utf8_lossy(&output.stdout);
        // A stop that waits for its answer for longer than a moment says so, on a busy machine.
        let is_shown = |line: &&str| !line.contains("no answer yet: if the motor pulls");
        let printed: String = printed.split_inclusive('\n').filter(is_shown).collect();
        let command = &line.command;
        if output.status.code() != Some(code) {
            let status = output.status;
            return Err(format!("`{command}` ends with {status} instead of {code}:\n{printed}"));
        }
        if !is_as_shown(&line.prints, &printed.lines().collect::<Vec<_>>()) {
            return Err(line.differs(&printed));
        }
        Ok(())
    }

    fn start(&mut self, line: &ConsoleLine) -> Result<(), String> {
        let path = self.folder.path().join(format!(".screen-{}", self.running.len()));
        let screen = File::create(&path).expect("it can be written");
        let child = self
            .shell(&["bash"], &format!("exec {}", line.command))
            .stdin(Stdio::piped())
            .stdout(screen.try_clone().expect("a second handle"))
            .stderr(screen)
            .spawn()
            .expect("bash starts");
        self.running.push((line.command.clone(), Killed(child)));
        // Whatever comes after what is shown belongs to later.
        let shown = [&line.prints[..], &["...".to_owned()]].concat();
        self.wait_for_screen(&path, &shown)
            .map_err(|printed| line.differs(&printed))
    }

    fn wait_for_screen(&mut self, path: &PathBuf, shown: &[String]) -> Result<(), String> {
        let began = Instant::now();
        loop {
            let last = self.running.last_mut();
            let ended = last.is_none_or(|(_, last)| last.try_wait().is_ok_and(|end| end.is_some()));
            let printed = fs::read_to_string(path).unwrap_or_default();
            if is_as_shown(shown, &printed.lines().collect::<Vec<_>>()) {
                return Ok(());
            }
            if ended || began.elapsed() > PATIENCE {
                return Err(printed);
            }
            pause();
        }
    }

    /// The newest program of this name that keeps running.
    fn running(&mut self, program: &str) -> Result<usize, String> {
        self.running
            .iter()
            .rposition(|(command, _)| command.split(' ').next() == Some(program))
            .ok_or_else(|| format!("no {program} runs"))
    }

    fn type_into(&mut self, program: &str, lines: &[String]) -> Result<(), String> {
        let place = self.running(program)?;
        let input = self.running[place].1.stdin.as_mut().expect("it is piped");
        lines
            .iter()
            .try_for_each(|line| writeln!(input, "{line}"))
            .map_err(|error| format!("{program} takes no lines: {error}"))
    }

    fn interrupt(&mut self, program: &str) -> Result<(), String> {
        let place = self.running(program)?;
        let (_, mut ended) = self.running.remove(place);
        signal(ended.id(), Signal::INT);
        ended.wait().map(drop).map_err(|error| error.to_string())
    }
}
