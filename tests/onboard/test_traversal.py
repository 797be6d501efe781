"""The executive: every command in every state, pauses that paint nothing twice, starts that are refused."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from tests.onboard.rig import Run, chain, start, trajectory
from tests.with_full import with_full
from touchline.onboard import Onboard
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle

IDLE, READY, RUNNING = TraversalStatus.IDLE, TraversalStatus.READY, TraversalStatus.RUNNING
PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
ABORTED, ESTOPPED = TraversalStatus.ABORTED, TraversalStatus.ESTOPPED

LINE = trajectory(chain((0.0, 12.0)), sprays=((5.0, 10.0),))
SHORT = trajectory(chain((0.0, 1.0)), speed=0.8)


def in_state(state: int) -> Run:
    run = start(SHORT if state == DONE else LINE, "pure-pursuit")
    onboard = run.onboard
    if state in (IDLE, READY):
        onboard.abort()
        onboard.reset()
        if state == READY:
            onboard.load(LINE)
    elif state == RUNNING:
        run.until_arc(1.0)
    elif state == PAUSED:
        run.until_arc(1.0)
        onboard.pause()
        run.ticks(200)
    elif state == DONE:
        run.until(DONE)
        run.ticks(100)
    elif state == ABORTED:
        run.until_arc(1.0)
        onboard.abort()
        run.ticks(200)
    elif state == ESTOPPED:
        run.until_arc(1.0)
        onboard.estop()
        run.ticks(200)
    assert onboard.state == state
    return run


COMMANDS: dict[str, Callable[[Onboard], object]] = {
    "load": lambda onboard: onboard.load(LINE),
    "start": Onboard.start,
    "pause": Onboard.pause,
    "resume": Onboard.resume,
    "abort": Onboard.abort,
    "estop": Onboard.estop,
    "reset": Onboard.reset,
}
ALLOWED = {
    "load": {IDLE: READY, READY: READY, DONE: READY, ABORTED: READY},
    "start": {READY: RUNNING},
    "pause": {RUNNING: PAUSED},
    "resume": {PAUSED: RUNNING},
    "abort": {READY: ABORTED, RUNNING: ABORTED, PAUSED: ABORTED},
    "estop": dict.fromkeys((IDLE, READY, RUNNING, PAUSED, DONE, ABORTED, ESTOPPED), ESTOPPED),
    "reset": {ESTOPPED: PAUSED, DONE: IDLE, ABORTED: IDLE},
}


@pytest.mark.parametrize("state", [IDLE, READY, RUNNING, PAUSED, DONE, ABORTED, ESTOPPED])
def test_every_command_in_every_state(state: int) -> None:
    run = in_state(state)
    for command in COMMANDS:
        if state not in ALLOWED[command]:
            with pytest.raises(CommandRefused, match=f"cannot {command} while"):
                COMMANDS[command](run.onboard)
            run.tick()
            assert run.onboard.state == state
            assert run.command.valve is False
    for command, allowed in ALLOWED.items():
        if state in allowed:
            COMMANDS[command](run.onboard)
            assert run.onboard.state == allowed[state], command
            run.tick()
            assert run.command.valve is False
            run = in_state(state)


@pytest.mark.parametrize(("before", "after"), [(IDLE, IDLE), (READY, READY), (PAUSED, PAUSED), (DONE, IDLE)])
def test_reset_after_an_emergency_stop(before: int, after: int) -> None:
    run = in_state(before)
    run.onboard.estop()
    run.ticks(50)
    run.onboard.reset()
    assert run.onboard.state == after
    run.ticks(100)
    assert abs(run.rig.speed) < 1e-3


def test_reset_while_still_rolling_is_refused() -> None:
    run = in_state(RUNNING)
    run.onboard.estop()
    run.tick()
    with pytest.raises(CommandRefused, match="while the robot is moving"):
        run.onboard.reset()


def test_runs_to_the_end_and_says_so() -> None:
    run = start(LINE)
    assert run.onboard.status.remaining_s == pytest.approx(13.0)
    run.until(DONE)
    run.ticks(100)
    status = run.onboard.status
    assert status.arc_length_m == pytest.approx(12.0, abs=0.02)
    assert run.rig.x == pytest.approx(12.0, abs=0.03)
    assert status.remaining_s == 0.0
    assert status.elapsed_s == pytest.approx(13.0, abs=1.5)
    assert run.onboard.lateral_error_m == pytest.approx(0.0, abs=1e-3)
    assert [event.code for event in run.onboard.take_events()] == ["ready", "running", "done"]
    assert run.onboard.take_events() == []


@pytest.mark.parametrize("start_m", [5.0, 5.0025, 5.005, 5.0075])
def test_paint_begins_and_ends_within_two_millimetres_of_where_it_is_told(start_m: float) -> None:
    """At 1 m/s a tick is a centimetre; the valve's delays come on top."""
    run = start(trajectory(chain((0.0, 10.0)), sprays=((start_m, 13.0 - start_m),)))
    run.until(DONE)
    ((begins, ends),) = run.painted
    assert begins == pytest.approx(start_m + Vehicle().tool.valve_on_delay_s, abs=2e-3)
    assert ends == pytest.approx(13.0 - start_m + Vehicle().tool.valve_off_delay_s, abs=2e-3)


def joints(painted: list[tuple[float, float]]) -> list[float]:
    """Gaps (positive) and overlaps (negative) between strokes, in m."""
    return [after[0] - before[1] for before, after in itertools.pairwise(painted)]


@pytest.mark.parametrize("noise", with_full("none", full=("default",)))
def test_pause_and_resume_leave_no_gap_and_paint_nothing_twice(noise: str) -> None:
    run = start(LINE, noise=noise, seed=2)
    for place in (4.8, 6.0, 8.0, 9.9):
        run.until_arc(place)
        run.onboard.pause()
        assert run.tick().valve is False
        run.ticks(150)
        assert abs(run.rig.speed) < 0.01
        run.onboard.resume()
    run.until(DONE)
    tolerance = 0.01 if noise == "none" else 0.02
    assert all(-0.02 < gap < tolerance for gap in joints(run.painted)), run.painted
    assert run.painted[0][0] == pytest.approx(5.015, abs=0.02)
    assert run.painted[-1][1] == pytest.approx(10.03, abs=0.02)
    assert len(run.painted) == 4  # the first pause is before the line, the others inside


def test_resume_while_still_braking() -> None:
    run = start(LINE)
    run.until_arc(7.0)
    run.onboard.pause()
    run.ticks(20)
    run.onboard.resume()
    assert any(run.tick().actuators), "that is no move-off: it does not warn first"
    run.until(DONE)
    assert len(run.painted) == 2
    assert all(-0.02 < gap < 0.01 for gap in joints(run.painted))


def test_emergency_stop_brakes_hardest_and_leaves_no_gap() -> None:
    run = start(LINE)
    run.until_arc(7.0)
    x = run.rig.x
    run.onboard.estop()
    assert run.tick().valve is False
    run.ticks(60)
    assert abs(run.rig.speed) < 0.01
    assert run.rig.x - x < 0.25
    run.onboard.reset()
    run.ticks(100)
    assert abs(run.rig.speed) < 1e-3
    run.onboard.resume()
    run.until(DONE)
    assert all(-0.02 < gap < 0.01 for gap in joints(run.painted))
    assert run.painted[-1][1] == pytest.approx(10.03, abs=0.01)


def test_emergency_stop_over_the_start_of_a_line_paints_it_after_all() -> None:
    run = start(LINE)
    run.until_arc(4.95)
    run.onboard.estop()
    run.ticks(60)
    assert run.rig.x > 5.03
    run.onboard.reset()
    run.onboard.resume()
    run.until(DONE)
    assert run.painted[0][0] == pytest.approx(5.015, abs=0.01)


def test_resume_far_beside_the_path_is_refused() -> None:
    run = start(LINE)
    run.until_arc(7.0)
    run.onboard.pause()
    run.ticks(150)
    run.rig.y += 1.0  # carried
    run.ticks(400)
    with pytest.raises(CommandRefused, match="beside its path"):
        run.onboard.resume()


@pytest.mark.parametrize(("dx", "turn", "words"), [(1.5, 0.0, "1.50 m and 0°"), (0.0, 0.8, "0.00 m and 46°")])
def test_wrong_start_pose_aborts_with_a_reason(dx: float, turn: float, words: str) -> None:
    run = start(LINE)
    run.rig.x += dx
    run.rig.heading += turn
    run.until(ABORTED, limit=200)
    assert words in run.onboard.status.reason
    assert run.rig.speed == 0.0


def test_start_before_the_estimator_is_ready_waits() -> None:
    run = start(LINE)
    run.rig.silent = True
    run.ticks(500)
    assert run.onboard.state == RUNNING
    assert "aligning" in run.onboard.status.reason
    assert run.rig.speed == 0.0
    run.rig.silent = False
    run.until_arc(1.0)
    assert run.onboard.status.reason == ""


def test_pause_during_alignment() -> None:
    run = start(LINE)
    run.ticks(10)
    run.onboard.pause()
    run.ticks(200)
    assert run.rig.speed == 0.0
    run.onboard.resume()
    run.until(DONE)
