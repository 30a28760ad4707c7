"""Subscriptions: a connection of their own, which a thread reads whatever the program does.

The daemon disconnects a client that does not read for two seconds, so a program that draws a picture between two
samples must not be the one that reads.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

from hapticd.connection import Connection
from hapticd.errors import HapticdError

T = TypeVar("T")


def subscribe(
    path: Path,
    topics: Sequence[str],
    take: Callable[[dict[str, Any]], object],
    end: Callable[[HapticdError], object],
    begin: Callable[[dict[str, Any]], object] = lambda answer: None,
    **fields: Any,
) -> Connection:
    """Subscribes on a connection, and hands each event to a function, on a thread of its own.

    Args:
        take: Called with each event.
        end: Called once, with the reason, when no event comes any more; not if the subscription is refused.
        begin: Called with the daemon's answer, before the first event.
        fields: More fields of the request.
    """
    has_begun = False

    def begin_once(answer: dict[str, Any]) -> None:
        nonlocal has_begun
        begin(answer)
        has_begun = True

    connection = Connection(path, take, lambda reason: end(reason) if has_begun else None)
    try:
        connection.request("subscribe", {"topics": list(topics), **fields}, begin_once)
    except BaseException:
        connection.close()
        raise
    return connection


class Queue(Generic[T]):
    """Items from one thread to another, with an end, and a bound on what waits."""

    def __init__(self, most: float, size: Callable[[T], int]) -> None:
        self._items: deque[T] = deque()
        self._most = most
        self._size = size
        self._waiting = 0
        self._changed = threading.Condition()
        self._ended: HapticdError | None = None

    def put(self, item: T) -> list[T]:
        """Adds an item; returns the oldest ones that had to go for it."""
        gone = []
        with self._changed:
            self._items.append(item)
            self._waiting += self._size(item)
            while self._waiting > self._most and len(self._items) > 1:
                gone.append(self._items.popleft())
                self._waiting -= self._size(gone[-1])
            self._changed.notify()
        return gone

    def end(self, reason: HapticdError) -> None:
        """Nothing more comes."""
        with self._changed:
            self._ended = reason
            self._changed.notify_all()

    def get(self, timeout_s: float | None = None) -> T:
        """The oldest item.

        Raises:
            HapticdError: Nothing more comes.
            TimeoutError: Nothing has come in time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: self._items or self._ended, timeout_s):
                raise TimeoutError
            if not self._items:
                assert self._ended is not None
                raise self._ended.with_traceback(None)
            item = self._items.popleft()
            self._waiting -= self._size(item)
            return item
