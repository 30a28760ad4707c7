"""The dead man's switch: the daemon releases the rig should this program die, or hang."""

from __future__ import annotations

import threading
import time

from hapticd.connection import Connection
from hapticd.errors import HapticdError, LeaseLapsed


class Lease:
    """The lease of a connection, renewed by a thread of its own, however busy the program is.

    A renewal waits for no answer: the daemon counts a line when it reads it, whatever it still has to do for the lines
    before.

    Attributes:
        timeout_ms: Silence after which the daemon releases the rig, ms.
    """

    def __init__(self, connection: Connection, timeout_ms: int) -> None:
        self.timeout_ms = timeout_ms
        self._connection = connection
        self._renewed_s = time.monotonic()
        self._renewing = threading.Lock()
        connection.request("lease", {"timeout_ms": timeout_ms})
        entries = connection.request("log", {"limit": 1})["entries"]
        self._journal_seq: int = entries[-1]["seq"] if entries else 0
        self._ended = threading.Event()
        self._lapsed: LeaseLapsed | None = None
        self._thread = threading.Thread(target=self._beat, name="hapticd lease", daemon=True)
        self._thread.start()

    def _beat(self) -> None:
        # Four renewals in the time: one may come late.
        while not self._ended.wait(self.timeout_ms / 4000):
            try:
                with self._renewing:
                    self._renew()
            except HapticdError:
                # The connection is lost, and so the lease has lapsed: the next request says why.
                return

    def _renew(self) -> None:
        silent_s = time.monotonic() - self._renewed_s
        self._renewed_s = time.monotonic()
        self._connection.tell("lease", {"timeout_ms": self.timeout_ms})
        if silent_s * 1e3 >= self.timeout_ms and self._has_lapsed():
            self._lapsed = LeaseLapsed(
                f"hapticd has released the rig: this program was silent for {silent_s * 1e3:.0f} ms, "
                f"and its lease is {self.timeout_ms} ms; it holds again from now on"
            )

    def _has_lapsed(self) -> bool:
        """Whether the daemon's journal says so, since the last look."""
        entries = self._connection.request("log", {"after": self._journal_seq})["entries"]
        self._journal_seq = entries[-1]["seq"] if entries else self._journal_seq
        session = self._connection.hello["session"]
        return any(each["op"] == "lease_lapsed" and each["by"]["session"] == session for each in entries)

    def check(self) -> None:
        """Tells, once, that the lease has lapsed.

        Raises:
            LeaseLapsed: The daemon has released the rig, because this program was silent.
        """
        # Before what is asked for now, however this program goes on after it was held up.
        with self._renewing:
            if (time.monotonic() - self._renewed_s) * 1e3 >= self.timeout_ms:
                self._renew()
            lapsed, self._lapsed = self._lapsed, None
        if lapsed is not None:
            raise lapsed

    def close(self, *, keep: bool) -> None:
        """Ends the renewals.

        Args:
            keep: Whether the lease ends as well. Else it lapses with the connection, and the daemon releases the rig.
        """
        self._ended.set()
        self._thread.join()
        if keep and not self._connection.is_closed:
            self._connection.request("lease", {"timeout_ms": 0})
