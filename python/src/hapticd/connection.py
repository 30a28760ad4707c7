"""One connection to the daemon: lines of JSON over a Unix stream socket."""

from __future__ import annotations

import contextlib
import json
import math
import os
import socket
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hapticd.errors import ConnectionLost, NoAnswer, NoDaemon, NotAllowed, refusal

PROTOCOL_VERSION = 1

#: How long the daemon may take to answer, s. It answers within a tick; a disk of its own may take 2 s.
ANSWER_TIMEOUT_S = 5.0


class Connection:
    """A connection, which one thread uses at a time.

    Attributes:
        hello: The daemon's greeting.
    """

    def __init__(self, path: Path) -> None:
        """Connects.

        Raises:
            NoDaemon: Nobody listens there.
            NotAllowed: This user may not connect.
            Refused: The daemon refuses the connection.
        """
        self._path = path
        self._lock = threading.Lock()
        self._next_id = 1
        self._is_closed = False
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(ANSWER_TIMEOUT_S)
        try:
            self._socket.connect(os.fspath(path))
            self._lines = self._socket.makefile("rb")
        except PermissionError as error:
            self._socket.close()
            message = f"{path}: {error.strerror}; is this user a member of the socket's group?"
            raise NotAllowed({"code": "not_permitted", "message": message}) from error
        except (ConnectionRefusedError, FileNotFoundError) as error:
            self._socket.close()
            raise NoDaemon(f"hapticd does not listen on {path}: {error.strerror}") from error
        greeting = self.read()
        if "error" in greeting:
            self.close()
            raise refusal(greeting["error"])
        self.hello: dict[str, Any] = greeting["hello"]
        if self.hello["protocol"] != PROTOCOL_VERSION:
            self.close()
            raise NoDaemon(
                f"{self.hello['server']} on {path} speaks version {self.hello['protocol']} of the protocol, "
                f"and this package version {PROTOCOL_VERSION}"
            )

    @property
    def is_closed(self) -> bool:
        """Whether it was closed, or has failed."""
        return self._is_closed

    def request(self, op: str, fields: Mapping[str, Any], timeout_s: float | None = None) -> dict[str, Any]:
        """Asks, and waits for the answer.

        Args:
            timeout_s: How long the answer may take beyond the usual time, s.

        Raises:
            Refused: The daemon refuses; nothing has changed.
            NoAnswer: It does not answer in time. The connection is closed.
            ConnectionLost: The connection is closed.
        """
        with self._lock:
            asked = self._next_id
            self._next_id += 1
            line = encoded({"id": asked, "op": op, **fields})
            self._socket.settimeout(ANSWER_TIMEOUT_S + (timeout_s or 0.0))
            try:
                self._socket.sendall(line)
            except OSError as error:
                self.close()
                raise ConnectionLost(f"the connection to hapticd at {self._path} is closed: {error}") from error
            answer = self.read()
            while answer.get("id") != asked:
                answer = self.read()
        if "error" in answer:
            raise refusal(answer["error"])
        ok: dict[str, Any] = answer["ok"]
        return ok

    def wait_for_ever(self) -> None:
        """Lets `read` wait as long as it takes: events come when there are some."""
        self._socket.settimeout(None)

    def read(self) -> dict[str, Any]:
        """The next line."""
        try:
            line = self._lines.readline()
        except TimeoutError as error:
            self.close()
            raise NoAnswer(f"hapticd at {self._path} has not answered in time") from error
        except (OSError, ValueError) as error:
            self.close()
            raise ConnectionLost(f"the connection to hapticd at {self._path} is closed") from error
        if not line.endswith(b"\n"):
            self.close()
            raise ConnectionLost(f"hapticd at {self._path} has closed the connection")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """Closes the connection; a thread that reads from it wakes up."""
        if self._is_closed:
            return
        self._is_closed = True
        # The daemon may have been faster.
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        # A thread that reads has woken up, and lets go of them.
        self._lines.close()
        self._socket.close()


def encoded(request: Mapping[str, Any]) -> bytes:
    """A line of a request.

    Raises:
        ValueError: A number is not finite: JSON has no such numbers.
    """
    try:
        return json.dumps(request, allow_nan=False).encode() + b"\n"
    except ValueError:
        name, value = next(_not_finite("", request), ("a value", "it"))
        raise ValueError(f"{name} = {value} is not a finite number") from None


def _not_finite(name: str, value: object) -> Any:
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _not_finite(str(key), each)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _not_finite(name, each)
    elif isinstance(value, float) and not math.isfinite(value):
        yield name, value
