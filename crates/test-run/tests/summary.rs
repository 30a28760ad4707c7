//! Prints what this run of `cargo test` skipped, and what it left to the long run. It runs last.

fn main() {
    let not_done = test_run::take_not_done();
    list("skipped", &not_done.skipped);
    list("left to HAPTICD_TEST_LONG=1", &not_done.left_out);
}

fn list(what: &str, lines: &[String]) {
    if lines.is_empty() {
        println!("\nnothing was {what}");
        return;
    }
    println!("\n{} {what}:", lines.len());
    for line in lines {
        println!("  {line}");
    }
}
