"""Where the control socket is: haptic-ctl looks in the same places."""

from __future__ import annotations

import grp
import os
import re
import stat
from pathlib import Path

from hapticd.errors import invalid

_SOCKET = "control.sock"

_RIG_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}")

#: The directories of systemd's units.
_UNITS = ["/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system"]


def candidates(rig: str | None = None) -> list[Path]:
    """The sockets at which a client looks, in order; those of the service hapticd@RIG for a rig with a name; `hapticd`
    is the rig without one. Where none is named `$HAPTICD_SOCKET` is the only one where it is set.
    """
    if rig is None and (named := os.environ.get("HAPTICD_SOCKET")):
        return [Path(named)]
    service = "hapticd" if rig in (None, "hapticd") else f"hapticd@{rig}"
    user = os.geteuid()
    places = [os.environ.get("XDG_RUNTIME_DIR"), f"/run/user/{user}"]
    if user != 0 and (home := os.environ.get("HOME")):
        places.append(f"{home}/.local/state")
    places.append("/run")
    return [Path(place) / service / _SOCKET for place in dict.fromkeys(places) if place]


def for_client(path: str | os.PathLike[str] | None, rig: str | None = None) -> Path:
    """The socket to connect to: the one given, else the first candidate that exists, else the first in a directory
    that this user may not enter, else that of a service that has run here, else the first of all.

    Raises:
        InvalidValue: `rig` cannot be the name of a rig, or both are given.
    """
    if rig is not None and not _RIG_NAME.fullmatch(rig):
        raise invalid("rig", f"rig = {rig!r}: the name of a rig has 1 to 64 letters, digits, `_`, `.` and `-`")
    if path is not None:
        if rig is not None:
            raise invalid("rig", f"rig = {rig!r}: the socket {os.fspath(path)} is given already; give one of the two")
        return Path(path)
    paths = candidates(rig)
    has_run = (each for each in paths if unit(each) and each.parent.is_dir())
    return next(
        (each for each in paths if os.path.exists(each)),
        next((each for each in paths if _is_hidden(each)), next(has_run, paths[0])),
    )


def _is_hidden(path: Path) -> bool:
    """Whether a directory that this user may not enter may have it."""
    try:
        path.stat()
    except PermissionError:
        return True
    except OSError:
        pass
    return False


def unit(path: Path) -> str | None:
    """The installed systemd unit, without its suffix, whose socket this is."""
    found = re.fullmatch(r"/run/(hapticd(@[A-Za-z0-9_.-]{1,64})?)/[^/]+", os.fspath(path))
    if not found:
        return None
    file = "hapticd@.service" if found[2] else "hapticd.service"
    return found[1] if any(os.path.exists(os.path.join(folder, file)) for folder in _UNITS) else None


def start_remedy(path: Path) -> str:
    """What a user does where no daemon serves the socket."""
    if name := unit(path):
        return (
            f"`journalctl -u {name}` says why the service does not run, such as a wrong configuration; "
            f"`sudo systemctl restart {name}` starts it"
        )
    if os.environ.get("HAPTICD_SOCKET") == str(path):
        return "HAPTICD_SOCKET names it: start hapticd there, or unset the variable"
    if path.parent.name.startswith("hapticd@"):
        return f"start the service {path.parent.name}, or leave out the rig's name"
    if path != for_client(None):
        return f"check the path, or start one there with `hapticd --demo --socket {path}`"
    return "start one with `hapticd --demo`, or name its socket with HAPTICD_SOCKET"


def permission_remedy(path: Path) -> str:
    """What a user does who may not use the socket, or may not enter the directory that hides it."""
    closed = next(each for each in (path, *path.absolute().parents) if os.path.exists(each))
    found = closed.stat()
    if not found.st_mode & (stat.S_IXGRP if closed.is_dir() else stat.S_IWGRP):
        return f"{closed} is for its owner alone; `hapticd --socket-group GROUP` lets a group use it"
    try:
        group = grp.getgrgid(found.st_gid).gr_name
    except KeyError:
        group = str(found.st_gid)
    return f"{closed} is for the group {group}: `sudo usermod -aG {group} $USER`, then log in again"
