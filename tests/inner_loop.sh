#!/usr/bin/env bash
# How long somebody waits after a change: seconds until the first test of the changed crate has passed, until everything is
# compiled, and until everything is tested. The crates are built before, each is changed in its lib.rs or main.rs, and put
# back at the end.
#
#   tests/inner_loop.sh                        # haptic-core, hapticd, haptic-ctl and the panel
#   tests/inner_loop.sh haptic-core            # one of them
#   CARGO_INCREMENTAL=0 tests/inner_loop.sh    # with another setting, to compare
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never
crates=("$@")
[ ${#crates[@]} != 0 ] || crates=(haptic-core hapticd haptic-ctl haptic-panel)

changed=()
put_back() {
    for file in "${changed[@]}"; do mv "$file.unchanged" "$file"; done
}
trap put_back EXIT

# Prints the seconds until a command has printed a line; the command is ended with it.
until_line() {
    local pattern=$1 began=$EPOCHREALTIME
    shift
    "$@" 2>&1 | grep -m1 -q -- "$pattern" || true
    awk "BEGIN { printf \"%.0f\", $EPOCHREALTIME - $began }"
}

cargo test --workspace --quiet --no-run
for crate in "${crates[@]}"; do
    cargo test --quiet --no-run --package "$crate"
done
printf '%-14s %22s %20s %18s\n' crate 'first test of it' 'all compiled' 'all tested'
for crate in "${crates[@]}"; do
    file=crates/$crate/src/lib.rs
    [ -e "$file" ] || file=crates/$crate/src/main.rs
    cp "$file" "$file.unchanged"
    changed+=("$file")
    # Code, and not a comment, so that what imports it is looked at again.
    change() { printf '\n/// %s\n#[allow(missing_docs, dead_code, unreachable_pub)]\npub fn changed() -> u32 { %d }\n' "$1" "$1" | cat "$file.unchanged" - >"$file"; }
    change 1
    first=$(until_line '^test .* ok$' cargo test --package "$crate")
    change 2
    compiled=$(until_line 'Executable' cargo test --workspace --no-run)
    tested=-
    if [ -n "${TESTED:-}" ]; then tested=$(until_line 'left to HAPTICD' cargo test --workspace); fi
    printf '%-14s %20s s %18s s %16s s\n' "$crate" "$first" "$compiled" "$tested"
done
