"""Prints how long an hour at 1 kHz takes to read, in each format.

    python benchmarks/read.py                   # needs 3 GB in the temporary directory
    python benchmarks/read.py --minutes 6

The hour is ten seconds of a simulated rig over and over: the same chunks of rows, in one file.
"""

from __future__ import annotations

import argparse
import resource
import struct
import subprocess
import tempfile
import time
from pathlib import Path

import hapticd

_CHUNK, _DATA_END = 0x06, 0x0F


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="How long a recording takes to read.")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--directory", help="where files go meanwhile [default: the temporary directory]")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.directory) as name:
        directory = Path(name)
        long = directory / "long.mcap"
        repeat(recorded(directory / "short.mcap"), long, times=round(given.minutes * 6))
        for path in (long, exported(long, "parquet"), exported(long, "csv")):
            # Once before, so that neither the disk nor an import is what is measured.
            path.read_bytes()
            hapticd.read(directory / "short.mcap")
            began_s, used_s = time.monotonic(), cpu_s()
            rows = len(hapticd.read(path))
            print(
                f"{path.suffix[1:]:8} {rows} rows, {path.stat().st_size / 1e6:.0f} MB: "
                f"{time.monotonic() - began_s:.2f} s, {cpu_s() - used_s:.2f} s of processor",
                flush=True,
            )
            if path is not long:
                path.unlink()


def recorded(path: Path) -> Path:
    """Ten seconds of a simulated rig."""
    with hapticd.fake() as daemon, daemon.connect() as rig:
        rig.engage()
        command = [str(ctl()), "record", str(path), "--for", "10s"]
        subprocess.run(command, env={"HAPTICD_SOCKET": str(daemon.path)}, check=True, stdout=subprocess.DEVNULL)
    return path


def exported(path: Path, ending: str) -> Path:
    """The same in another format."""
    other = path.with_suffix(f".{ending}")
    subprocess.run([str(ctl()), "recording", "export", str(path), str(other)], check=True, stdout=subprocess.DEVNULL)
    return other


def ctl() -> Path:
    """haptic-ctl, beside hapticd."""
    return hapticd.binary().with_name("haptic-ctl")


def repeat(short: Path, long: Path, times: int) -> None:
    """Writes a recording whose chunks come again and again, without an end."""
    data = short.read_bytes()
    # The last chunk has the mark of the end.
    at, first, last = 8, None, len(data)
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == _CHUNK:
            first, last = first or at, at
        if opcode == _DATA_END:
            break
        at += 9 + length
    assert first is not None
    with long.open("wb") as file:
        file.write(data[:first])
        for _ in range(times):
            file.write(data[first:last])
        # An end of the data, and a footer without a summary.
        file.write(struct.pack("<BQI", _DATA_END, 4, 0) + struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + data[:8])


def cpu_s() -> float:
    """Processor time of this process with all its threads, s."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
