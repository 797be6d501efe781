"""A loop that turns is told from one that hangs."""

import os
import stat
import time

import pytest

from touchline.services.system.heartbeat import VARIABLE, Heartbeat, HeartbeatWatch
from touchline.services.system.shutdown import until_stopped


@pytest.fixture
def watch(tmp_path):
    return HeartbeatWatch(tmp_path / "robot.heartbeat")


def test_silence_counts_from_the_first_beat_on(watch):
    for now_s in (0.0, 0.2, 100.0, 100.2):
        watch.look(now_s)
    assert (watch.begun, watch.quiet_s) == (False, 0.0), "its kernels are being compiled"
    Heartbeat(watch.path).beat()
    watch.look(100.3)
    watch.look(100.5)
    assert watch.begun
    assert watch.quiet_s == pytest.approx(0.2)
    Heartbeat(watch.path).beat()
    watch.look(100.6)
    assert watch.quiet_s == 0.0


def test_a_supervisor_that_was_held_up_accuses_nobody(watch):
    Heartbeat(watch.path).beat()
    watch.look(0.0)
    watch.look(60.0)
    assert watch.quiet_s < 0.5
    for turn in range(10):
        watch.look(60.0 + 0.1 * turn)
    assert watch.quiet_s > 0.5


def test_whoever_asks_whether_to_stop_beats(watch, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(watch.path))
    with until_stopped(supervisor=os.getppid()) as stop:
        assert VARIABLE not in os.environ, "what it starts would beat in its place"
        watch.look(0.0)
        assert not watch.begun
        assert not stop
        watch.look(0.1)
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
    watch.look(time.monotonic())
    assert watch.begun
