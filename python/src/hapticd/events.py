"""What happens to the rig, as it happens."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hapticd.closing import Closing
from hapticd.errors import Faulted, Stopped
from hapticd.sample import State, checked_state
from hapticd.subscription import Queue, subscribe

#: Events that may wait for a slow program.
WAITING = 100_000


class Events(Closing):
    """Events from now on, one after another: each is an object as on the wire, with its topic in `event`."""

    def __init__(self, path: Path, topics: Sequence[str]) -> None:
        self._queue: Queue[dict[str, Any]] = Queue(WAITING, lambda event: 1)
        self._subscription = subscribe(path, topics, self._queue.put, self._queue.end)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self

    def __next__(self) -> dict[str, Any]:
        """The next event. See `get`."""
        return self.get()

    def get(self, timeout_s: float | None = None) -> dict[str, Any]:
        """The next event.

        Raises:
            TimeoutError: None has come in time.
            ConnectionLost: The connection to the daemon is closed.
        """
        return self._queue.get(timeout_s)

    def wait_for(self, state: State, timeout_s: float) -> int:
        """Waits until the rig is in a state; returns the tick since which it is."""
        checked_state(state)
        until_s = time.monotonic() + timeout_s
        now: str | None = None
        while True:
            try:
                event = self.get(max(until_s - time.monotonic(), 0.0))
            except TimeoutError:
                found = f"the rig is {now}, and not {state}," if now else "no state has come"
                raise TimeoutError(f"{found} after {timeout_s:g} s") from None
            if event["event"] != "state":
                continue
            now = event["state"]
            if now == state:
                tick: int = event["tick"]
                return tick
            if now == "stopped":
                raise Stopped({"code": "stopped", "message": f"the rig was stopped before it was {state}"})
            if now == "faulted":
                message = f"the rig is faulted ({event.get('fault')}) before it was {state}"
                raise Faulted({"code": "faulted", "message": message})

    def close(self) -> None:
        """Ends the subscription."""
        self._subscription.close()
