#!/usr/bin/env bash
# Steers hapticd from a shell, with socat and jq:  examples/client.sh [SOCKET]
# Engages the rig, makes its block heavier, shows how its state changes, and stops it.
set -euo pipefail
SOCKET=${1:-${HAPTICD_SOCKET:-}}
if [ -z "$SOCKET" ]; then # where haptic-ctl looks too: the first that is there
    PLACES=("${XDG_RUNTIME_DIR:-/run/user/$EUID}" "/run/user/$EUID")
    if [ "$EUID" != 0 ]; then PLACES+=("$HOME/.local/state"); fi
    for PLACE in "${PLACES[@]}" /run; do
        SOCKET=$PLACE/hapticd/control.sock
        if [ -e "$SOCKET" ]; then break; fi
    done
fi
[ -S "$SOCKET" ] || { echo "hapticd at $SOCKET: there is no socket" >&2; exit 1; }

# One connection for all: what is written to ${RIG[1]} goes to the daemon, what it says comes from ${RIG[0]}.
coproc RIG { socat - "UNIX-CONNECT:$SOCKET"; }
next_line() { IFS= read -r -t 10 LINE <&"${RIG[0]}" || { echo "hapticd says nothing" >&2; exit 1; }; }

# ask ID OP [MORE]: sends a request and waits for its answer, which is left in LINE. Events that come in between are shown.
ask() {
    jq -nc --argjson id "$1" --arg op "$2" --argjson more "${3:-{\}}" '{$id, $op} + $more' >&"${RIG[1]}"
    while next_line && ! jq -e --argjson id "$1" '.id == $id' <<<"$LINE" >/dev/null; do show_state; done
    # A refusal has an `error`: a code for programs, a message for people.
    if jq -e .error <<<"$LINE" >/dev/null; then jq -r '"refused: \(.error.code): \(.error.message)"' <<<"$LINE" >&2; exit 1; fi
}
STATE='{}' # the newest that was heard of; it may come before the answer to what has brought it about
show_state() {
    jq -e '.event == "state"' <<<"$LINE" >/dev/null || return 0
    STATE=$LINE
    jq -r '"state: \(.state), \(.params.mass) kg, at tick \(.tick)"' <<<"$STATE"
}
# wait_for FILTER: reads events until the state fits.
wait_for() { until jq -e "$1" <<<"$STATE" >/dev/null; do next_line; show_state; done; }

next_line # the server speaks first
jq -r '"connected to \(.hello.server)"' <<<"$LINE"
ask 1 subscribe '{"topics": ["state"]}'
ask 2 engage
wait_for '.state == "engaged"'
ask 3 set '{"params": {"mass": 1.5, "Fs": 5}}' # kg, N: all of it between two ticks, or nothing
wait_for '.params.mass == 1.5'
ask 4 stop # zero force in the next tick; only `reset` clears it
jq -r '"the rig is \(.ok.state), until `haptic-ctl reset`"' <<<"$LINE"
