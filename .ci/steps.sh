# What the gate and the full run share: steps that are timed, what their tests need, and the table at the end.
# shellcheck shell=bash

export CARGO_TERM_COLOR=never
# Nobody edits and builds again here: what only the next build has use of is not written.
export CARGO_INCREMENTAL=0

# What was begun beside something that failed does not outlive it.
trap 'for job in $(jobs -p); do kill -- "-$job" || kill "$job"; done 2>/dev/null || true' EXIT

# The commands that the README gives are the ones that are run here.
TEST_COMMAND='cargo test --workspace'
DEMO_COMMAND='cargo run --release --bin hapticd -- --demo'
for promised in "$TEST_COMMAND" "$DEMO_COMMAND"; do
    grep -qxF "$promised" README.md || { echo "README.md does not give the command: $promised"; exit 1; }
done

table=''
failed=''
row() {
    table+=$(printf '%6s s  %s' "$1" "$2")$'\n'
}

# Runs a step under a name. One that fails fails the run, once the others have been run too.
step() {
    local name=$1 began=$SECONDS
    shift
    printf '\n== %s (%d s)\n' "$name" "$SECONDS"
    # In a shell of its own, which a failure ends; in a condition it would not.
    set +e
    (
        set -e
        "$@"
    )
    local code=$?
    set -e
    if [ $code = 0 ]; then
        row $((SECONDS - began)) "$name"
    else
        row $((SECONDS - began)) "$name: FAILED"
        failed+=" $name;"
    fi
}

leave_out() {
    echo "LEFT OUT: $1"
    row - "$1"
}

# Prints the table; fails if a step has.
end() {
    row "$SECONDS" 'in all'
    printf '\n%s' "$table"
    if [ -n "$failed" ]; then
        echo "== failed:${failed%;}"
        exit 1
    fi
    echo '== passed'
}

# Only what is listed here may be skipped; each skip is in the summary after the tests. These are a machine's or a
# container's rights, which nothing installs, and a real machine's record, which is not part of the repository.
permitted='SCHED_FIFO,SCHED_DEADLINE,locked memory,ptrace,seccomp,namespaces,cgroup v2,two processors,emps-pulses.csv'
# Some tests need the superuser, and one an ordinary user.
if [ "$(id -u)" = 0 ]; then permitted+=',an ordinary user'; else permitted+=',root'; fi

# Installs what tests need: lines of what they name as missing, how to see whether it is there, and the Debian packages
# that bring it. Where it may install, nothing of that may be skipped.
install_needs() {
    local need look packages missing=() more
    while IFS='|' read -r need look packages; do
        if [ -n "$need" ] && ! sh -c "$look" >/dev/null 2>&1; then
            read -ra more <<<"$packages"
            missing+=("${more[@]}")
        fi
    done <<<"$1"
    if [ ${#missing[@]} != 0 ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
    fi
}

# Permits the skips of what is missing all the same, where nothing can be installed; elsewhere it fails.
permit_missing() {
    local need look packages
    while IFS='|' read -r need look packages; do
        if [ -n "$need" ] && ! sh -c "$look" >/dev/null 2>&1; then
            echo "missing: $need ($packages)"
            permitted+=",$need"
            [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null || exit 1
        fi
    done <<<"$1"
}

# Installs a cargo command, unless that version is there. Unoptimised: it works for seconds, and is built for minutes.
cargo_command() {
    local crate=$1 version=$2
    shift 2
    if ! cargo install --list | grep -qxF "$crate v$version:"; then
        cargo install --quiet --debug --locked --version "$version" "$@" "$crate"
    fi
}

# What the Python package wants from the network.
python_environment() {
    python3 -m venv target/python/venv
    target/python/venv/bin/pip install --quiet --disable-pip-version-check --constraint python/constraints.txt \
        './python[numpy,pandas,plot,lsl,examples,test]'
}
