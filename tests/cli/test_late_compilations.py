"""Compiling after the start is reported, and does not look like a loop that hangs."""

from importlib import import_module

import pytest

from tests.meeting import eventually
from touchline.supervision.heartbeat import Heartbeat, HeartbeatWatch
from touchline.supervision.late_compilations import KEY, LateCompilations
from touchline.supervision.shutdown import Stop


@pytest.fixture
def watch(tmp_path):
    return HeartbeatWatch(tmp_path / "robot.heartbeat")


@pytest.fixture
def stop(watch):
    return Stop(None, Heartbeat(watch.path))


@pytest.fixture
def njit():
    """Loaded here: few workers compile anything."""
    return import_module("numba").njit


@pytest.fixture
def late(stop, njit):
    found = LateCompilations(stop)
    found.watch()
    yield found
    found._compilations.__exit__(None, None, None)


def added(x):
    return x + 1


def test_it_is_told_by_name_and_logged(late, njit, caplog):
    assert late.values() == {}
    njit(added)(1)
    assert late.values() == {KEY: "test_late_compilations.added"}
    assert "test_late_compilations.added was compiled after the start" in caplog.text
    assert late.current == ""


def test_the_loop_is_heard_of_while_it_compiles(late, njit, watch, stop, monkeypatch):
    asked = []
    monkeypatch.setattr(stop, "beating", lambda: asked.append(late.current) or Stop.beating(stop))
    njit(added)(1.0)
    assert asked == ["test_late_compilations.added"]


def test_work_that_takes_long_beats(stop, watch):
    values = set()

    def beats():
        watch.look(0.0, lambda: None)
        values.add(watch._last)
        return len(values) > 2

    with stop.beating():
        assert eventually(beats)


def test_work_without_end_falls_silent(stop, watch, monkeypatch):
    monkeypatch.setattr("touchline.supervision.shutdown.WORK_S", 0.0)
    with stop.beating():
        assert not eventually(lambda: watch.look(0.0, lambda: None) or watch.begun, 0.5)
