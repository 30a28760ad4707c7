//! Prints what this run of `cargo test` skipped, and what it left to the long run. It runs last.

fn main() {
    test_run::print_not_done();
}
