#!/usr/bin/env python3
"""Plants every change of some files in one build, and holds each against the tests: tests/mutants.sh
calls it.

cargo-mutants names the changes. Every function that some of them change gets a body for each, and
$HAPTICD_MUTANT chooses one when the tests run: a package is compiled once and not once for each
change. Those that do not compile are left out. A constant function chooses nothing when the tests
run, nor does a constant, and a function that returns an `impl` has one type: their changes are left to
cargo-mutants itself.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

CHOICE = """
#[doc(hidden)]
#[allow(missing_docs, unreachable_pub, dead_code)]
pub fn planted_mutant() -> u32 {
    static MUTANT: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *MUTANT.get_or_init(|| std::env::var("HAPTICD_MUTANT").map_or(0, |number| number.parse().expect("a number")))
}
"""


def listed(tree, package, files):
    """The changes that cargo-mutants knows."""
    command = ["cargo", "mutants", "--list", "--json", "--dir", tree, "--package", package]
    command += ["--exclude", "**/*_tests.rs", *(f"--file={file}" for file in files)]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    mutants = json.loads(answer.stdout)
    for number, mutant in enumerate(mutants, 1):
        mutant |= {"number": number, "end": "planted" if mutant["function"] else "constant"}
    return mutants


def offset(lines, place):
    """Where a line and a column are in a text."""
    return sum(map(len, lines[: place["line"] - 1])) + place["column"] - 1


def body_begins(text, end):
    """Where the last group of braces before an end begins."""
    depth = 0
    for at in range(end - 1, -1, -1):
        depth += {"}": 1, "{": -1}.get(text[at], 0)
        if depth == 0:
            return at
    raise ValueError("braces that do not match")


def with_all(text, mutants):
    """A file with a body for each of its mutants."""
    lines = text.splitlines(keepends=True)
    functions = {}
    for mutant in mutants:
        span = mutant["function"]["span"]
        functions.setdefault((offset(lines, span["start"]), offset(lines, span["end"])), []).append(mutant)
    # From the last one on, so that the places before stay.
    for (begin, end), changes in sorted(functions.items(), reverse=True):
        body = body_begins(text, end)
        if re.search(r"\bconst\s+fn\b|->\s*impl\b", text[begin:body]):
            for mutant in changes:
                mutant["end"] = "constant"
            continue
        arms = ""
        for mutant in changes:
            at, to = (offset(lines, mutant["span"][side]) for side in ("start", "end"))
            changed = f"{text[body + 1 : at]} {mutant['replacement']} {text[to : end - 1]}"
            arms += f"/*<{mutant['number']}>*/ {mutant['number']}u32 => {{ {changed} }}\n"
        original = f"/*<0>*/ _ => {{ {text[body + 1 : end - 1]} }}"
        text = f"{text[:body]}{{ match crate::planted_mutant() {{\n{arms}{original}\n}} }}{text[end:]}"
    return text


def plant(tree, root, mutants, originals):
    """Writes the files; returns for every line of them which mutant it belongs to."""
    belongs = {}
    for file, text in originals.items():
        text = with_all(text, [m for m in mutants if m["file"] == file and m["end"] == "planted"])
        if file == root:
            # A crate without the standard library has it in this build.
            text = text.replace("#[cfg(test)]\nextern crate std;", "extern crate std;") + CHOICE
        (tree / file).write_text(text)
        number, belongs[file] = 0, []
        for line in text.splitlines():
            for mark in re.findall(r"/\*<(\d+)>\*/", line):
                number = int(mark)
            belongs[file].append(number)
    return belongs


def build(tree, root, package, target, mutants):
    """The tests' programs, with all mutants that compile."""
    files = {mutant["file"] for mutant in mutants} | {root}
    originals = {file: (tree / file).read_text() for file in files}
    while True:
        belongs = plant(tree, root, mutants, originals)
        command = ["cargo", "test", "--no-run", "--package", package, *target, "--message-format", "json"]
        answer = subprocess.run(command, cwd=tree, capture_output=True, text=True)
        messages = [json.loads(line) for line in answer.stdout.splitlines() if line.startswith("{")]
        if answer.returncode == 0:
            return [one["executable"] for one in messages if one.get("executable") and one["profile"]["test"]]
        wrong = {
            belongs[span["file_name"]][span["line_start"] - 1]
            for one in messages
            if one["reason"] == "compiler-message" and one["message"]["level"] == "error"
            for span in one["message"]["spans"]
            if span["is_primary"] and span["file_name"] in belongs
        } - {0}
        if not wrong:
            sys.exit(f"it does not compile:\n{answer.stderr}")
        for mutant in mutants:
            if mutant["number"] in wrong:
                mutant["end"] = "unviable"


def hold(programs, folder, number, timeout_s, tests):
    """Runs the tests with one mutant; says how that ended."""
    environment = os.environ | {"HAPTICD_MUTANT": str(number), "CARGO_MANIFEST_DIR": str(folder)}
    for program in programs:
        command = [program, *tests]
        try:
            ended = subprocess.run(command, cwd=folder, env=environment, timeout=timeout_s, capture_output=True)
        except subprocess.TimeoutExpired as late:
            # A test that saw it may have been quicker than the one that it holds up.
            return "caught" if b" ... FAILED" in (late.stdout or b"") else "timeout"
        if ended.returncode:
            return "caught"
    return "missed"


def by_itself(tree, out, package, mutants, timeout_s, target, tests):
    """Leaves mutants to cargo-mutants, each with a build of its own."""
    subprocess.run(["git", "-C", tree, "checkout", "--quiet", "--force", "HEAD"], check=True)
    command = ["cargo", "mutants", "--dir", tree, "--in-place", "--output", out, "--timeout", str(timeout_s)]
    command += ["--package", package, "--colors", "never", "--no-shuffle"]
    for mutant in mutants:
        command += [f"--file={mutant['file']}", "--re", f"^{re.escape(mutant['name'])}$"]
    answer = subprocess.run([*command, "--", *target, "--", *tests], capture_output=True, text=True)
    # 2: some lived; 3: some took too long.
    if answer.returncode not in (0, 2, 3):
        sys.exit(answer.stdout + answer.stderr)
    for end in ("caught", "missed", "timeout", "unviable"):
        names = (out / "mutants.out" / f"{end}.txt").read_text().splitlines()
        for mutant in mutants:
            if mutant["name"] in names:
                mutant["end"] = end


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--tree", type=Path, required=True, help="a clone that may be changed")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--package", required=True)
    parser.add_argument("--files", nargs="+", required=True, help="from the clone's folder on")
    parser.add_argument("--integration", help="an integration test to hold them against after the crate's own")
    parser.add_argument("tests", nargs="*", help="after `--`: what the tests' program gets")
    given = parser.parse_args()
    given.tree, given.out = given.tree.resolve(), given.out.resolve()
    source = f"crates/{given.package}/src"
    is_library = (given.tree / source / "lib.rs").exists()
    target = ["--lib"] if is_library else ["--bins"]
    if given.integration:
        target += ["--test", given.integration]
    root = f"{source}/{'lib' if is_library else 'main'}.rs"
    timeout_s = int(os.environ.get("HAPTICD_MUTANTS_TIMEOUT_S", "120"))

    mutants = listed(given.tree, given.package, given.files)
    programs = build(given.tree, root, given.package, target, mutants)
    folder = given.tree / "crates" / given.package
    if hold(programs, folder, 0, timeout_s, given.tests) != "missed":
        sys.exit("the tests fail without any change")
    # One at a time: two at once would make each other's timings fail, and a mutant caught by that
    # alone is not caught.
    for mutant in mutants:
        if mutant["end"] == "planted":
            mutant["end"] = hold(programs, folder, mutant["number"], timeout_s, given.tests)
    constant = [mutant for mutant in mutants if mutant["end"] == "constant"]
    if constant:
        by_itself(given.tree, given.out, given.package, constant, timeout_s, target, given.tests)
    (given.out / "mutants.json").write_text(json.dumps([[m["end"], m["name"]] for m in mutants], indent=1))
    ends = [mutant["end"] for mutant in mutants]
    print(
        f"{ends.count('caught')} caught, {ends.count('timeout')} ended by time, "
        f"{ends.count('unviable')} do not compile, {ends.count('missed')} lived:\n"
    )
    for mutant in mutants:
        if mutant["end"] in ("missed", "timeout"):
            print(f"- {mutant['end']}: {mutant['name']}")


main()
