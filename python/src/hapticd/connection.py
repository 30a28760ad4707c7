"""One connection to the daemon: lines of JSON over a Unix stream socket."""

from __future__ import annotations

import contextlib
import json
import math
import operator
import os
import socket
import struct
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, SupportsFloat

from hapticd.errors import ConnectionLost, HapticdError, NoAnswer, NoDaemon, NotAllowed, Refused, invalid, refusal
from hapticd.socket_path import permission_remedy, start_remedy

PROTOCOL_VERSION = 1

#: How long the daemon may take to answer, s. It answers within a tick; a disk of its own may take 2 s.
ANSWER_TIMEOUT_S = 5.0


class _Answer:
    """An answer that is waited for."""

    def __init__(self, take: Callable[[dict[str, Any]], object] | None) -> None:
        self.line: dict[str, Any] | None = None
        self.is_there = threading.Event()
        self._take = take

    def put(self, line: dict[str, Any]) -> None:
        self.line = line
        if self._take is not None and "ok" in line:
            self._take(line["ok"])
        self.is_there.set()


class Connection:
    """A connection, which any thread may use at any time; a thread of its own reads from it.

    Attributes:
        hello: The daemon's greeting.
    """

    def __init__(
        self,
        path: Path,
        take: Callable[[dict[str, Any]], object] = lambda event: None,
        end: Callable[[HapticdError], object] = lambda reason: None,
    ) -> None:
        """Connects.

        Args:
            take: Called with each event, on the connection's thread.
            end: Called once, with the reason, when nothing comes any more.

        Raises:
            NoDaemon: Nobody listens there.
            NotAllowed: This user may not connect.
            Refused: The daemon refuses the connection.
        """
        self._path = path
        self._take = take
        self._end = end
        # Guards what follows; nothing that may block is done under it.
        self._lock = threading.Lock()
        self._sending = threading.Lock()
        self._next_id = 1
        self._answers: dict[int, _Answer] = {}
        self._lost: HapticdError | None = None
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self.hello = self._greeted()
        except BaseException:
            self._socket.close()
            raise
        self._thread = threading.Thread(target=self._read, name="hapticd connection", daemon=True)
        self._thread.start()

    def _greeted(self) -> dict[str, Any]:
        self._socket.settimeout(ANSWER_TIMEOUT_S)
        try:
            self._socket.connect(os.fspath(self._path))
            self._lines = self._socket.makefile("rb")
            greeting = self._lines.readline()
        except PermissionError as error:
            message = f"{self._path}: {error.strerror}; {permission_remedy(self._path)}"
            raise NotAllowed({"code": "not_permitted", "message": message}) from error
        except TimeoutError as error:
            raise NoAnswer(f"hapticd at {self._path} has not answered in time") from error
        except OSError as error:
            message = f"hapticd does not listen on {self._path}: {error.strerror}; {start_remedy(self._path)}"
            raise NoDaemon(message) from error
        if not greeting:
            raise ConnectionLost(f"hapticd at {self._path} has closed the connection; {start_remedy(self._path)}")
        line = json.loads(greeting)
        try:
            if "error" in line:
                raise refusal(line["error"])
            hello: dict[str, Any] = line["hello"]
            if hello["protocol"] != PROTOCOL_VERSION:
                raise NoDaemon(
                    f"{hello['server']} at {self._path} speaks version {hello['protocol']} of the protocol, "
                    f"and this package version {PROTOCOL_VERSION}"
                )
        except HapticdError:
            self._lines.close()
            raise
        # From here on a thread waits for lines as long as it takes; only writing has a limit.
        self._socket.settimeout(None)
        limit = struct.pack("@ll", int(ANSWER_TIMEOUT_S), 0)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
        return hello

    @property
    def is_closed(self) -> bool:
        """Whether it was closed, or has failed."""
        return self._lost is not None

    def request(
        self, op: str, fields: Mapping[str, Any], take: Callable[[dict[str, Any]], object] | None = None
    ) -> dict[str, Any]:
        """Asks, and waits for the answer.

        Args:
            take: Called with the answer on the connection's thread, before any event that follows it.

        Raises:
            Refused: The daemon refuses; nothing has changed.
            NoAnswer: It does not answer in time. The connection is closed.
            ConnectionLost: The connection is closed.
        """
        answer = self.tell(op, fields, take)
        if not answer.is_there.wait(ANSWER_TIMEOUT_S):
            reason = f"hapticd at {self._path} has not answered `{op}` in time; connect again"
            self._lose(NoAnswer(reason))
        line = answer.line
        if line is None:
            raise self._reason()
        if "error" in line:
            raise refusal(line["error"])
        ok: dict[str, Any] = line["ok"]
        return ok

    def tell(
        self, op: str, fields: Mapping[str, Any], take: Callable[[dict[str, Any]], object] | None = None
    ) -> _Answer:
        """Asks, and waits for nothing."""
        with self._lock:
            if self._lost is not None:
                raise self._reason()
            asked = self._next_id
            self._next_id += 1
            line = encoded({"id": asked, "op": op, **fields})
            answer = self._answers[asked] = _Answer(take)
        try:
            # One line after another; a thread that was interrupted amid a line has spoilt the connection.
            with self._sending:
                self._socket.sendall(line)
        except OSError as error:
            self._lose(ConnectionLost(f"the connection to hapticd at {self._path} is lost: {error}"))
            raise self._reason() from error
        except BaseException:
            self._lose(ConnectionLost(f"the connection to hapticd at {self._path} was interrupted"))
            raise
        return answer

    def _read(self) -> None:
        reason: HapticdError = ConnectionLost(f"hapticd at {self._path} has closed the connection")
        try:
            for text in self._lines:
                line = json.loads(text)
                if "event" in line:
                    self._take(line)
                    continue
                with self._lock:
                    answer = self._answers.pop(line.get("id"), None)
                if answer is not None:
                    answer.put(line)
                elif "error" in line:
                    # The daemon says why it closes the connection.
                    reason = refusal(line["error"])
        except (OSError, ValueError) as error:
            reason = ConnectionLost(f"the connection to hapticd at {self._path} is lost: {error}")
        finally:
            self._lose(reason)
            self._end(self._reason())

    def _lose(self, reason: HapticdError) -> None:
        with self._lock:
            if self._lost is None:
                self._lost = reason
            answers, self._answers = self._answers, {}
        for answer in answers.values():
            answer.is_there.set()
        # The daemon may have been faster.
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def _reason(self) -> HapticdError:
        """Why it is closed, as an exception that may be raised."""
        lost = self._lost
        assert lost is not None
        if isinstance(lost, Refused):
            return lost.with_traceback(None)
        return type(lost)(*lost.args)

    def close(self) -> None:
        """Closes it."""
        self._lose(ConnectionLost(f"the connection to hapticd at {self._path} was closed here"))
        if self._thread is not threading.current_thread():
            self._thread.join()
        self._lines.close()
        self._socket.close()


def encoded(request: Mapping[str, Any]) -> bytes:
    """A line of a request.

    Raises:
        InvalidValue: A number is not finite, or a value is of a type that JSON does not have.
    """
    try:
        return json.dumps(request, allow_nan=False, default=_plain).encode() + b"\n"
    except TypeError:
        name, value = _first(request, _is_of_no_type)
        raise invalid(name, f"{name} = {value!r} is not a number, a text, a list or an object") from None
    except ValueError:
        name, value = _first(request, _is_not_finite)
        raise invalid(name, f"{name} = {value} is not a finite number", "not_finite") from None


def _plain(value: Any) -> Any:
    """A number of another kind, as numpy's, as one of JSON."""
    if str(getattr(value, "dtype", "")) == "bool":
        return bool(value)
    # An array of one number that is not whole has the method as well, and refuses.
    with contextlib.suppress(TypeError):
        return operator.index(value)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError from None


def _is_of_no_type(value: object) -> bool:
    if value is None or isinstance(value, str | int | float):
        return False
    try:
        _plain(value)
    except TypeError:
        return True
    return False


def _is_not_finite(value: object) -> bool:
    return isinstance(value, SupportsFloat) and not math.isfinite(value)


def _first(request: Mapping[str, Any], is_wanted: Callable[[object], bool]) -> tuple[str, Any]:
    """The first value of a kind in a request, with the name of the field that it stands in."""
    return next(((name, value) for name, value in _values("", request) if is_wanted(value)), ("a value", "it"))


def _values(name: str, value: object) -> Iterator[tuple[str, object]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _values(str(key), each)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _values(name, each)
    else:
        yield name, value
