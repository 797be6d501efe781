"""The valve is never open unless everything is well, whatever is commanded and whatever fails."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.onboard.rig import Rig, Run, chain, start, trajectory
from touchline.onboard import Onboard
from touchline.onboard import filter_model as m
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.executive.localization_monitor import (
    MAX_HEADING_SIGMA_RAD,
    LocalizationMonitor,
)
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus

RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE
LINE = trajectory(chain((0.0, 16.0)), sprays=((5.0, 14.0),))


def lose_fix(rig: Rig) -> None:
    rig.fix = 2


def old_corrections(rig: Rig) -> None:
    rig.correction_age_s = 30.0


def silence(rig: Rig) -> None:
    rig.silent = True


def jump(rig: Rig) -> None:
    rig.fix_offset_m = (0.0, 0.3)


def well(rig: Rig) -> None:
    rig.fix, rig.correction_age_s, rig.silent, rig.fix_offset_m = 3, 0.0, False, (0.0, 0.0)


@pytest.mark.parametrize(
    ("cause", "words"),
    [(lose_fix, "float fix"), (old_corrections, "corrections are older"), (silence, "no fix for more than")],
)
def test_a_fault_stops_the_paint_and_it_goes_on_by_itself(cause: Callable[[Rig], None], words: str) -> None:
    run = start(LINE, noise="none")
    run.until_arc(8.0)
    cause(run.rig)
    ticks = run.until(PAUSED, limit=100)
    assert ticks < 75, "within three quarters of a second"
    assert run.command.valve is False
    assert words in run.onboard.status.reason
    run.ticks(200)
    assert abs(run.rig.speed) < 0.01
    with pytest.raises(CommandRefused, match="cannot resume"):
        run.onboard.resume()
    well(run.rig)
    run.until(DONE)
    (first, second) = run.painted
    assert first[0] == pytest.approx(5.015, abs=0.01)
    assert -0.02 < second[0] - first[1] < 0.01
    assert any(event.severity == 1 and words in event.text for event in run.onboard.take_events())


@pytest.mark.parametrize("follower", ["mpc", "pure-pursuit"])
def test_a_pause_ends_at_rest_whatever_speed_is_believed(follower: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """After a slide the estimate may have the robot going backward: braking on it would drive it on for ever."""
    run = start(LINE, follower, noise="none")
    run.until_arc(4.0)
    true_speed = Estimator.speed_now_mps
    monkeypatch.setattr(Estimator, "speed_now_mps", lambda estimator: true_speed(estimator) - 0.3)
    run.onboard.pause()
    run.ticks(250)
    assert abs(run.rig.speed) < 1e-3


def test_run_in_too_short_for_the_heading_is_driven_again() -> None:
    """A line that begins before the heading is known: back and forth until it is, then all of it is painted."""
    plan = trajectory(chain((0.0, 8.0)), sprays=((0.6, 6.0),))
    run = start(plan, noise="default", seed=4)
    began = []
    while run.onboard.state in (RUNNING, PAUSED):
        if run.tick().valve and not began:
            began.append(run.onboard.estimator.covariance[m.HEADING, m.HEADING])
    assert run.onboard.state == DONE
    assert math.sqrt(began[0]) <= MAX_HEADING_SIGMA_RAD
    assert run.painted[0][0] == pytest.approx(0.615, abs=0.04)
    assert run.painted[-1][1] == pytest.approx(6.03, abs=0.04)


def test_gives_up_after_some_tries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LocalizationMonitor, "paint_problem", lambda *_: "the nozzle is off its line")
    run = start(LINE, noise="default")
    for _ in range(15000):
        run.tick()
        if "gave up after 3 tries" in run.onboard.status.reason:
            break
    run.ticks(1500)
    assert run.onboard.state == PAUSED
    assert "gave up after 3 tries" in run.onboard.status.reason
    assert run.painted == []


COMMANDS = {
    "load": lambda onboard: onboard.load(LINE),
    "start": Onboard.start,
    "pause": Onboard.pause,
    "resume": Onboard.resume,
    "abort": Onboard.abort,
    "estop": Onboard.estop,
    "reset": Onboard.reset,
    "link_lost": Onboard.link_lost,
}
ACTIONS = st.one_of(
    st.sampled_from(sorted(COMMANDS)),
    st.sampled_from([lose_fix, old_corrections, silence, jump, well, well, well]),
)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.integers(1, 400), ACTIONS), max_size=12), st.integers(0, 3))
def test_invariants_under_any_commands_and_faults(script: list[tuple[int, object]], seed: int) -> None:
    run = start(LINE, noise="default", seed=seed)
    run.until_arc(4.0)
    for wait, action in script:
        _check(run, wait)
        if isinstance(action, str):
            try:
                COMMANDS[action](run.onboard)
            except CommandRefused as refusal:
                assert str(refusal)
        else:
            action(run.rig)
    _check(run, 300)
    run.onboard.estop()
    run.ticks(100)
    assert abs(run.rig.speed) < 0.01
    for before, after in zip(run.painted, run.painted[1:], strict=False):
        # Within one traversal nothing is painted twice; a new load starts from the beginning.
        assert after[0] > before[1] - 0.05 or after[0] < 5.1


def _check(run: Run, ticks: int) -> None:
    """Tick by tick: an open valve needs RUNNING, a recent RTK fix and a place that the plan paints."""
    for _ in range(ticks):
        command = run.tick()
        state = run.onboard.state
        if command.valve or command.disc:
            assert state == RUNNING
        if command.valve:
            assert run.rig.fix == 3 or run.rig.in_flight, "painting without an RTK fix"
            assert 4.9 < run.onboard.status.arc_length_m < 14.1
            assert run.rig.speed > 0.0
        if state == TraversalStatus.ESTOPPED:
            assert command.actuators == (0.0, 0.0)
        assert all(map(math.isfinite, command.actuators))
