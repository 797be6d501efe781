"""The robot's behaviour when something other than its position goes wrong, and when it goes on."""

from __future__ import annotations

import pytest

from tests.onboard.rig import Run, chain, start, trajectory
from touchline.onboard.executive.localization_monitor import SLIP_SETTLE_S
from touchline.onboard.interface import TICK_S, Command
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus

RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE
ESTOPPED = TraversalStatus.ESTOPPED
LINE = trajectory(chain((0.0, 12.0)), sprays=((5.0, 10.0),))


def at(arc_length_m: float, noise: str = "none") -> Run:
    run = start(LINE, noise=noise)
    run.until_arc(arc_length_m)
    return run


def joint(run: Run) -> float:
    """Distance from the end of the paint before the stop to its beginning after it: negative is painted twice."""
    before, after = run.painted
    return after[0] - before[1]


def test_bumper_latches_until_reset() -> None:
    run = at(7.0)
    run.rig.bumper = True
    command = run.tick()
    assert command == Command((0.0, 0.0), False, False)
    assert run.onboard.state == ESTOPPED
    assert "bumper" in run.onboard.status.reason
    run.ticks(100)
    with pytest.raises(CommandRefused, match="while the bumper is pressed"):
        run.onboard.reset()
    run.rig.bumper = False
    run.ticks(1000)
    assert run.onboard.state == ESTOPPED and abs(run.rig.speed) < 1e-3
    with pytest.raises(CommandRefused):
        run.onboard.resume()
    run.onboard.reset()
    run.onboard.resume()
    run.until(DONE)
    assert -0.02 < joint(run) < 0.01


def test_operator_lost_stops_after_two_seconds_and_waits_for_a_resume() -> None:
    run = at(5.5)
    run.rig.operator = False
    run.ticks(195)
    assert run.onboard.state == RUNNING
    run.ticks(10)
    assert run.onboard.state == PAUSED and not run.command.valve
    assert "operator" in run.onboard.status.reason
    run.ticks(200)
    with pytest.raises(CommandRefused, match="operator has not been heard"):
        run.onboard.resume()
    run.rig.operator = True
    run.ticks(300)
    assert run.onboard.state == PAUSED
    run.onboard.resume()
    run.until(DONE)
    assert -0.02 < joint(run) < 0.01


def test_wheels_that_spin_stop_the_paint_for_longer_than_other_causes() -> None:
    run = at(7.0, "default")
    run.rig.spin_share = 0.5
    assert run.until(PAUSED, limit=100) < 40
    assert "the wheels slip" in run.onboard.status.reason
    run.rig.spin_share = 0.0
    waited_s = run.until(RUNNING, limit=1500) * TICK_S
    assert SLIP_SETTLE_S <= waited_s < SLIP_SETTLE_S + 3.0, (
        "nothing slips at standstill; the last seconds are of braking"
    )
    run.until(DONE)
    assert -0.03 < joint(run) < 0.03


def test_a_lasting_jump_waits_for_the_operator() -> None:
    run = at(7.0, "default")
    run.rig.fix_offset_m = (0.0, 0.3)
    assert run.until(PAUSED, limit=200) < 80
    assert "contradict" in run.onboard.status.reason
    run.ticks(3000)
    assert run.onboard.state == PAUSED, "a wrong fix that lasts does not move the painting"
    assert abs(run.onboard.estimate.north_m - run.rig.y) < 0.03
    run.onboard.resume()
    assert any(event.code == "position-accepted" for event in run.onboard.take_events())
    run.ticks(10)
    assert abs(run.onboard.estimate.north_m - run.rig.y - 0.3) < 0.03


@pytest.mark.parametrize("ahead_m", [-0.2, 0.2])
def test_a_move_of_the_position_leaves_no_gap_where_paint_stopped(ahead_m: float) -> None:
    run = at(7.0)
    run.rig.fix_offset_m = (ahead_m, 0.0)
    run.until(PAUSED, limit=200)
    run.ticks(400)
    run.onboard.resume()
    run.until(DONE)
    assert joint(run) == pytest.approx(-max(ahead_m, 0.0), abs=0.03), "what may be painted already is painted again"
