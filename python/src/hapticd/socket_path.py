"""Where the control socket is: haptic-ctl looks in the same places."""

from __future__ import annotations

import os
from pathlib import Path

_NAME = "hapticd/control.sock"


def candidates() -> list[Path]:
    """The sockets at which a client looks, in order. `$HAPTICD_SOCKET` is the only one where it is set."""
    if named := os.environ.get("HAPTICD_SOCKET"):
        return [Path(named)]
    user = os.geteuid()
    places = [os.environ.get("XDG_RUNTIME_DIR"), f"/run/user/{user}"]
    if user != 0 and (home := os.environ.get("HOME")):
        places.append(f"{home}/.local/state")
    places.append("/run")
    return [Path(place) / _NAME for place in dict.fromkeys(places) if place]


def for_client(path: str | os.PathLike[str] | None) -> Path:
    """The socket to connect to: the one given, else the first candidate that exists, else the first of all."""
    if path is not None:
        return Path(path)
    paths = candidates()
    return next((each for each in paths if each.exists()), paths[0])
