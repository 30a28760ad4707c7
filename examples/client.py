"""Steers hapticd from Python, with nothing but the standard library.

    python3 examples/client.py [SOCKET]       engages, makes the block heavier, and stops
or in a program of yours, with this file beside it:
    from client import Hapticd, Refused
    rig = Hapticd("/run/hapticd/control.sock")
    rig.request("set", params={"mass": 1.5, "Fs": 5.0})     # kg, N; all of it between two ticks, or nothing
"""
import itertools, json, os, socket, sys


class Refused(Exception):  # `error["code"]` for programs, `error["message"]` for people: docs/control.md lists the codes
    def __init__(self, error):
        super().__init__(error["message"])
        self.error = error


class Hapticd:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r", encoding="utf-8")  # one JSON object a line
        self.ids, self.early = itertools.count(1), []
        if error := (first := self.read()).get("error"):  # the server speaks first
            raise Refused(error)
        self.hello = first["hello"]

    def read(self):
        if line := self.lines.readline():
            return json.loads(line)
        raise ConnectionError("hapticd closed the connection")

    def request(self, op, **fields):  # asks and waits; `rig.request("get")` gives what `ok` holds
        asked = next(self.ids)
        self.socket.sendall(json.dumps({"id": asked, "op": op, **fields}).encode() + b"\n")
        while (line := self.read()).get("id", "event") != asked:  # events may come in between
            self.early.append(line)
        if "error" in line:
            raise Refused(line["error"])
        return line["ok"]

    def events(self):  # what was subscribed to, for ever
        while True:
            yield self.early.pop(0) if self.early else self.read()


if __name__ == "__main__":
    places = [os.environ.get("XDG_RUNTIME_DIR"), f"/run/user/{os.geteuid()}", os.path.expanduser("~/.local/state"), "/run"]
    usual = [f"{place}/hapticd/control.sock" for place in places if place]  # where haptic-ctl looks too
    path = (sys.argv[1:] or [os.environ.get("HAPTICD_SOCKET")])[0] or next(filter(os.path.exists, usual), usual[-1])
    try:
        rig = Hapticd(path)
        rig.request("subscribe", topics=["state"])
        rig.request("engage")  # the force rises along its ramp
        next(event for event in rig.events() if event["state"] == "engaged")
        print("tick of the change:", rig.request("set", params={"mass": 1.5, "Fs": 5.0}).get("tick", "none, it was so already"))
        print("the rig is", rig.request("stop")["state"])  # zero force in the next tick; only `reset` clears it
    except (OSError, Refused) as error:
        sys.exit(f"hapticd at {path}: {error}")
