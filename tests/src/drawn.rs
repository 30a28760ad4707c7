//! What the documents do not say by hand: parts of pages, and plots. With `HAPTICD_UPDATE_BOOK=1` they are drawn again,
//! and without it compared.

use std::fs;
use std::path::Path;

/// How a part is drawn again.
const REMEDY: &str =
    "draw it again with `HAPTICD_UPDATE_BOOK=1 cargo test -p system-tests --test system book` and look at it";

fn document(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name)
}

fn is_update() -> bool {
    std::env::var_os("HAPTICD_UPDATE_BOOK").is_some()
}

/// Holds a plot, a file of docs/images, to what it is now.
pub fn figure(name: &str, drawn: &str) {
    let path = document("images").join(name);
    if is_update() {
        fs::write(&path, drawn).expect("it can be written");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == drawn, "docs/images/{name} is stale: {REMEDY}");
}

/// Holds the part of a page between `<!-- drawn: NAME -->` and `<!-- end of NAME -->` to what it is now.
pub fn part(page: &str, name: &str, drawn: &str) {
    let path = document(page);
    let kept = fs::read_to_string(&path).expect("a page");
    let [begins, ends] = [format!("<!-- drawn: {name} -->\n"), format!("<!-- end of {name} -->")];
    let (before, rest) = kept.split_once(&begins).expect("where it begins");
    let (_, after) = rest.split_once(&ends).expect("where it ends");
    let now = format!("{before}{begins}\n{}\n\n{ends}{after}", drawn.trim());
    if is_update() {
        fs::write(&path, &now).expect("it can be written");
        return;
    }
    assert!(kept == now, "the part {name} of docs/{page} is stale: {REMEDY}");
}
