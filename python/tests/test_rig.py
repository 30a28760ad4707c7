from __future__ import annotations

import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy
import pytest

import hapticd


def test_a_rig_is_engaged_changed_and_released(rig: hapticd.Rig) -> None:
    assert rig.status().state == "idle"
    began = rig.engage()
    assert began.state == "engaging"
    assert rig.wait_for("engaged") > began.tick
    change = rig.set({"Fs+": 5}, mass=1.5, ramp="50ms")
    assert change.applied == {"mass": 1.5, "static_force+": 5.0}
    assert change.tick is not None and change.ramp_ends_tick is not None
    assert change.ramp_ends_tick - change.tick == 50
    assert [difference.param for difference in change.changes] == ["mass", "static_force"]
    assert rig.get().params["mass"] == 1.5
    assert rig.undo().changes[0].after == 0.5
    assert rig.redo().changes[0].after == 1.5
    assert rig.load("lugre").changes[0].param == "name"
    assert rig.release().state == "releasing"
    rig.wait_for("idle")


def test_numbers_may_come_from_numpy(rig: hapticd.Rig) -> None:
    revision = numpy.uint64(rig.get().revision)
    change = rig.set(mass=numpy.float32(1.5), Fs=numpy.float64(5), if_revision=int(revision))
    assert change.applied == {"mass": 1.5, "static_force": 5.0}
    assert rig.request("get", scene=revision)["params"]["mass"] == 0.5
    assert rig.set({"mass": numpy.array(0.75)}).applied == {"mass": 0.75}


def test_refusal_has_field_value_limits_and_unit(rig: hapticd.Rig) -> None:
    before = rig.get()
    with pytest.raises(hapticd.InvalidValue, match="mass = -1 kg is out of range") as refused:
        rig.set(mass=-1, Fs=5)
    error = refused.value
    assert isinstance(error, ValueError)
    assert (error.code, error.param, error.value, error.unit) == ("out_of_range", "mass", -1.0, "kg")
    assert (error.min, error.max) == (1e-6, 100.0)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), again.param, str(again)) == (hapticd.InvalidValue, "mass", str(error))
    with pytest.raises(hapticd.UnknownName, match="mas"):
        rig.set(mas=1)
    with pytest.raises(ValueError, match="Fs = inf is not a finite number"):
        rig.set(mass=1, Fs=numpy.float32("inf"))
    for value in (object(), 1 + 0j, numpy.array([1.5]), numpy.array("200 g")):
        with pytest.raises(hapticd.InvalidValue, match=r"mass = .* is not a number"):
            rig.set({"mass": value})  # type: ignore[dict-item]
    with pytest.raises(hapticd.InvalidValue, match="mass"):
        rig.set({"mass": numpy.True_})
    with pytest.raises(hapticd.Conflict):
        rig.set(mass=1, if_revision=before.revision + 7)
    with pytest.raises(hapticd.UnknownName):
        rig.load("no such scene")
    assert rig.get() == before


# hazard: F4
def test_stop_waits_for_nothing(rig: hapticd.Rig) -> None:
    rig.engage()
    rig.wait_for("engaged")
    # Another thread is amid a line.
    with rig._control._sending:
        assert rig.stop().state == "stopped"
    with pytest.raises(hapticd.Stopped):
        rig.engage()
    with pytest.raises(hapticd.Stopped):
        rig.wait_for("engaged")
    assert rig.reset().state == "idle"


# hazard: F4
def test_the_end_of_the_block_releases_the_rig(daemon: hapticd.Fake) -> None:
    with daemon.connect(lease=None) as watcher, watcher.events(["state"]) as events:
        with daemon.connect() as rig:
            rig.engage()
            events.wait_for("engaged", 10)
        events.wait_for("idle", 10)
        with daemon.connect(keep=True) as rig:
            rig.engage()
            events.wait_for("engaged", 10)
        assert watcher.status().state == "engaged"
        assert watcher.status().leases == 0
        with pytest.raises(ZeroDivisionError), daemon.connect(keep=True) as rig:
            raise ZeroDivisionError
        events.wait_for("idle", 10)


# hazard: F4
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_dies_or_hangs_loses_the_rig(daemon: hapticd.Fake, end: signal.Signals) -> None:
    program = (
        "import sys, hapticd\n"
        "with hapticd.connect(sys.argv[1], lease='200ms') as rig:\n"
        "    rig.engage()\n"
        "    sys.stdin.read()\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program, str(daemon.path)], stdin=subprocess.PIPE)
    try:
        with daemon.connect(lease=None) as watcher, watcher.events() as events:
            events.wait_for("engaged", 30)
            child.send_signal(end)
            events.wait_for("idle", 10)
            lapsed = [each for each in watcher.request("log")["entries"] if each["op"] == "lease_lapsed"]
            assert [each["by"]["pid"] for each in lapsed] == [child.pid]
    finally:
        child.kill()
        child.communicate()


def test_a_busy_interpreter_keeps_its_lease(daemon: hapticd.Fake) -> None:
    with daemon.connect(lease="2s") as rig:
        rig.engage()
        until = time.monotonic() + 2.5
        while time.monotonic() < until:
            sum(range(1000))
        assert rig.status().state in ("engaging", "engaged")


# hazard: F4
def test_a_lease_that_has_lapsed_is_reported(daemon: hapticd.Fake) -> None:
    with daemon.connect(lease="100ms") as rig:
        lease = rig._lease
        assert lease is not None
        rig.engage()
        # The thread that renews it is held up.
        with lease._connection._sending, rig.events(["state"]) as events:
            events.wait_for("idle", 10)
        # Before anything that would bring the force back.
        with pytest.raises(hapticd.LeaseLapsed, match="its lease is 100 ms"):
            rig.engage()
        assert rig.status().state == "idle"


def test_nobody_there_and_a_daemon_that_ends(daemon: hapticd.Fake) -> None:
    with pytest.raises(hapticd.NoDaemon, match=r"nowhere\.sock"):
        hapticd.connect(daemon.directory / "nowhere.sock")
    with pytest.raises(hapticd.InvalidValue, match="timeout_ms"):
        daemon.connect(lease="1ms")
    rig = daemon.connect()
    events = rig.events(["log"])
    samples = rig.samples()
    daemon.close()
    with pytest.raises(hapticd.ConnectionLost):
        for _ in events:
            pass
    with pytest.raises(hapticd.ConnectionLost):
        for _ in samples:
            pass
    with pytest.raises(hapticd.ConnectionLost):
        rig.status()
    for each in (events, samples, rig):
        each.close()


def test_watchers_may_look_and_stop(tmp_path: Path) -> None:
    path = tmp_path / "watch.sock"
    with hapticd.fake(watch_socket=path), hapticd.connect(path) as rig:
        assert rig.hello["rights"] == "watch"
        assert rig.status().leases == 0
        with pytest.raises(hapticd.NotAllowed):
            rig.engage()
        assert rig.stop().state == "stopped"


def test_threads_share_a_rig(rig: hapticd.Rig) -> None:
    masses: list[float] = []

    def change(mass: float) -> None:
        for _ in range(10):
            masses.append(rig.set(mass=mass).applied["mass"])

    threads = [threading.Thread(target=change, args=(1 + k / 10,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(masses) == sorted([1.0, 1.1, 1.2, 1.3] * 10)


def test_the_heart_needs_the_standard_library_alone(daemon: hapticd.Fake) -> None:
    program = (
        "import itertools, sys\n"
        "for name in ('numpy', 'pandas', 'pyarrow', 'pylsl'): sys.modules[name] = None\n"
        "import hapticd\n"
        "with hapticd.connect(sys.argv[1]) as rig, rig.samples() as samples, rig.events() as events:\n"
        "    rig.engage()\n"
        "    events.wait_for('engaged', 30)\n"
        "    print(rig.set(mass=1).applied, len(list(itertools.islice(samples, 50))))\n"
        "    try: rig.record(1)\n"
        "    except ImportError as error: print(error.name)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(daemon.path)], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["{'mass': 1.0} 50", "numpy"]
