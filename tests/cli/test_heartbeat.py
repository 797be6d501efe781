"""A loop that turns is told from one that hangs."""

import os
import signal
import stat
import subprocess
import sys
import time

import pytest

from tests.meeting import eventually
from touchline.supervision.heartbeat import VARIABLE, Heartbeat, HeartbeatWatch
from touchline.supervision.processor_use import ProcessorUse, processor_use
from touchline.supervision.shutdown import until_stopped


@pytest.fixture
def watch(tmp_path):
    return HeartbeatWatch(tmp_path / "robot.heartbeat")


def unknown():
    """Stands for a system that does not tell what a process does."""
    return


def test_silence_counts_from_the_first_beat_on(watch):
    for now_s in (0.0, 0.2, 100.0, 100.2):
        watch.look(now_s, unknown)
    assert (watch.begun, watch.quiet_s) == (False, 0.0), "its kernels are being compiled"
    Heartbeat(watch.path).beat()
    watch.look(100.3, unknown)
    watch.look(100.5, unknown)
    assert watch.begun
    assert watch.quiet_s == pytest.approx(0.2)
    Heartbeat(watch.path).beat()
    watch.look(100.6, unknown)
    assert watch.quiet_s == 0.0


def test_a_supervisor_that_was_held_up_accuses_nobody(watch):
    Heartbeat(watch.path).beat()
    watch.look(0.0, unknown)
    watch.look(60.0, unknown)
    assert watch.quiet_s < 0.5
    for turn in range(10):
        watch.look(60.0 + 0.1 * turn, unknown)
    assert watch.quiet_s > 0.5


def test_whoever_asks_whether_to_stop_beats(watch, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(watch.path))
    with until_stopped(supervisor=os.getppid()) as stop:
        assert VARIABLE not in os.environ, "what it starts would beat in its place"
        watch.look(0.0, unknown)
        assert not watch.begun
        assert not stop
        watch.look(0.1, unknown)
        assert watch.begun


def test_a_service_alone_has_no_heartbeat(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    with until_stopped() as stop:
        stop.beat()
        assert not stop


def test_the_file_is_private_and_made_anew(tmp_path):
    precious, path = tmp_path / "precious", tmp_path / "robot.heartbeat"
    precious.write_text("12345678 and more")
    path.symlink_to(precious)
    watch = HeartbeatWatch(path)
    Heartbeat(path).beat()
    assert precious.read_text() == "12345678 and more"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    watch.look(time.monotonic(), unknown)
    assert watch.begun


def quiet_after(watch, loop_s, others_s, *wants, turns=40):
    """Quiet seconds after looks every 0.1 s, between which threads of the process have so much processor time."""
    Heartbeat(watch.path).beat()
    for turn in range(turns + 1):
        watch.look(0.1 * turn, lambda turn=turn: ProcessorUse(loop_s * turn, (loop_s + others_s) * turn, *wants))
    return watch.quiet_s


@pytest.mark.parametrize(
    ("loop_s", "others_s", "loop_wants", "others_want"),
    [(0.002, 0.0, True, False), (0.002, 0.08, True, True), (0.0, 0.002, False, True)],
    ids=["alone", "others of it have one", "for one that waits for another thread"],
)
def test_a_loop_that_waits_for_a_processor_does_not_hang(watch, loop_s, others_s, loop_wants, others_want):
    assert quiet_after(watch, loop_s, others_s, loop_wants, others_want) < 0.5


@pytest.mark.parametrize(
    ("loop_s", "others_s", "loop_wants", "others_want"),
    [(0.0, 0.0, False, False), (0.1, 0.0, True, False), (0.0, 0.02, False, False), (0.0, 0.1, False, True)],
    ids=[
        "stopped or deadlocked",
        "an endless loop",
        "deadlocked, and other threads work now and then",
        "for another thread that runs without end",
    ],
)
def test_a_loop_that_could_have_turned_hangs(watch, loop_s, others_s, loop_wants, others_want):
    assert quiet_after(watch, loop_s, others_s, loop_wants, others_want) > 3.0


LOOP = """
import os, sys, threading
from touchline.supervision.heartbeat import Heartbeat
beat = Heartbeat.from_environment()
beat.beat()
print("begun", flush=True)
{}
"""
DOES = {
    "stopped": "while True: beat.beat()",
    "deadlocked": "lock = threading.Lock(); lock.acquire(); lock.acquire()",
    "endless": "while True: pass",
}


@pytest.mark.parametrize("kind", DOES)
def test_a_real_loop_that_does_not_turn_is_found(watch, kind):
    """However busy the machine: a loop that spins is given the time that it takes to have had a processor for 0.6 s."""
    command = [sys.executable, "-c", LOOP.format(DOES[kind])]
    environment = {**os.environ, VARIABLE: str(watch.path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout.readline() == "begun\n"
            if kind == "stopped":
                process.send_signal(signal.SIGSTOP)
                assert eventually(lambda: (use := processor_use(process.pid)) is not None and not use.loop_wants)
            assert eventually(lambda: looked(watch, process.pid) > 0.6, 400.0)
        finally:
            process.kill()


def looked(watch, pid):
    watch.look(time.monotonic(), lambda: processor_use(pid))
    return watch.quiet_s


@pytest.mark.skipif(not hasattr(os, "SCHED_IDLE"), reason="needs a class of processes that get little of a processor")
def test_a_real_loop_without_a_processor_is_not_accused(watch):
    """A process of the idle class waits most of the time for a processor that another one keeps busy.

    How much of it that gets is the kernel's affair, so it is measured: what it waited for is not counted.
    """
    one = {min(os.sched_getaffinity(0))}
    environment = {**os.environ, VARIABLE: str(watch.path)}
    starved = LOOP.format(
        f"os.sched_setaffinity(0, {one}); os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\nwhile True: pass"
    )
    busy = f"import os\nos.sched_setaffinity(0, {one})\nprint('begun', flush=True)\nwhile True: pass"
    with (
        subprocess.Popen([sys.executable, "-c", busy], stdout=subprocess.PIPE, text=True) as hog,
        subprocess.Popen([sys.executable, "-c", starved], stdout=subprocess.PIPE, text=True, env=environment) as loop,
    ):
        try:
            assert hog.stdout.readline() == loop.stdout.readline() == "begun\n"
            assert eventually(lambda: (use := processor_use(loop.pid)) is not None and use.loop_wants)
            begun_s, before_s = time.monotonic(), processor_use(loop.pid).loop_s
            had_s, waited_s = 0.0, 0.0
            while waited_s < 1.0:
                looked(watch, loop.pid)
                had_s = processor_use(loop.pid).loop_s - before_s
                waited_s = time.monotonic() - begun_s - had_s
                time.sleep(0.02)
            assert watch.quiet_s < 0.5 + had_s
        finally:
            hog.kill()
            loop.kill()
