//! Prints what this run of `cargo test` skipped. It runs last.

fn main() {
    let skipped = test_run::take_skipped();
    if skipped.is_empty() {
        println!("\nnothing was skipped");
        return;
    }
    println!("\n{} skipped:", skipped.len());
    for line in skipped {
        println!("  {line}");
    }
}
