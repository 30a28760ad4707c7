"""The dead man's switch: the daemon releases the rig should this program die, or hang."""

from __future__ import annotations

import threading
import time
from pathlib import Path

from hapticd.connection import Connection
from hapticd.errors import HapticdError, LeaseLapsed


class Lease:
    """A lease, renewed by a thread of its own on a connection of its own, however busy the program is.

    Attributes:
        timeout_ms: Silence after which the daemon releases the rig, ms.
    """

    def __init__(self, path: Path, timeout_ms: int) -> None:
        self.timeout_ms = timeout_ms
        self._connection = Connection(path)
        try:
            self._renew()
        except BaseException:
            self._connection.close()
            raise
        self._ended = threading.Event()
        self._lost: HapticdError | None = None
        self._thread = threading.Thread(target=self._beat, name="hapticd lease", daemon=True)
        self._thread.start()

    def _renew(self) -> None:
        self._renewed_s = time.monotonic()
        self._connection.request("lease", {"timeout_ms": self.timeout_ms})

    def _beat(self) -> None:
        # Four renewals in the time: one may come late.
        while not self._ended.wait(self.timeout_ms / 4000):
            late_s = time.monotonic() - self._renewed_s
            try:
                self._renew()
                if late_s * 1e3 >= self.timeout_ms and self._has_lapsed():
                    self._lost = LeaseLapsed(
                        f"hapticd has released the rig: this program was silent for {late_s * 1e3:.0f} ms, "
                        f"and its lease is {self.timeout_ms} ms"
                    )
            except HapticdError as error:
                self._lost = error
                self._connection.close()
                return

    def _has_lapsed(self) -> bool:
        entries = self._connection.request("log", {"limit": 100})["entries"]
        session = self._connection.hello["session"]
        return any(each["op"] == "lease_lapsed" and each["by"]["session"] == session for each in entries)

    def check(self) -> None:
        """Tells, once, that the lease has lapsed, and ever after that its connection is lost.

        Raises:
            LeaseLapsed: The daemon has released the rig, because this program was silent.
            ConnectionLost: The daemon has closed the connection.
        """
        lost = self._lost
        if isinstance(lost, LeaseLapsed):
            self._lost = None
        if lost is not None:
            raise lost.with_traceback(None)

    def close(self, *, lapse: bool) -> None:
        """Ends the lease.

        Args:
            lapse: Whether the daemon releases the rig.
        """
        self._ended.set()
        self._thread.join()
        try:
            if not lapse and not self._connection.is_closed:
                self._connection.request("lease", {"timeout_ms": 0})
        finally:
            self._connection.close()
