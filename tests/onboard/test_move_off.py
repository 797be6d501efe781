"""Stops and move-offs: who ordered a pause and what ends it, the warning before the wheels turn, the longest stop."""

from collections.abc import Callable

import pytest

from tests.onboard.rig import Rig, Run, chain, start, trajectory
from tests.two_wheels import STANDSTILL
from touchline.onboard import Onboard
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.executive.stop_causes import BY_WATCHDOG
from touchline.onboard.interface import Pause
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import PauseStatus, TraversalStatus
from touchline.schemas.onboard import MoveOffLimits, OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle

RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE
LINE = trajectory(chain((0.0, 12.0)), sprays=((5.0, 10.0),))
WARNING_TICKS = 200


def under_way(follower: str = "pure-pursuit") -> Run:
    run = start(LINE, follower)
    run.until_arc(6.0)
    return run


def pause_of(run: Run) -> Pause:
    pause = run.onboard.status.pause
    assert pause is not None
    return pause


def stand_ticks(run: Run, limit: int = 4000) -> int:
    """Ticks until the robot is told to move."""
    for count in range(limit):
        if any(run.command.actuators):
            return count
        run.tick()
    raise AssertionError("it does not move off")


def without_fix(run: Run) -> None:
    """Lose the fix on a line, and come to rest."""
    run.rig.fix = 0
    run.until(PAUSED)
    run.ticks(200)


CAUSES: list[tuple[Callable[[Run], object], int, str, bool]] = [
    (lambda run: run.onboard.pause(), PauseStatus.OPERATOR, "operator", False),
    (lambda run: run.onboard.pause("the loop hung", BY_WATCHDOG), PauseStatus.WATCHDOG, "watchdog", False),
    (lambda run: run.onboard.link_lost(), PauseStatus.LINK, "link", False),
    (lambda run: setattr(run.rig, "operator", False), PauseStatus.LINK, "operator not heard", False),
    (lambda run: setattr(run.rig, "tank_l", 0.01), PauseStatus.HAZARD, "tank-low", False),
    (lambda run: setattr(run.rig, "battery", 0.01), PauseStatus.HAZARD, "battery-low", False),
    (lambda run: setattr(run.rig, "blocked", 0), PauseStatus.HAZARD, "actuator", False),
    (lambda run: setattr(run.rig, "valve_stuck", False), PauseStatus.HAZARD, "too-little-paint", False),
    (lambda run: setattr(run.rig, "fix", 0), PauseStatus.LOCALIZATION, "localization", True),
]


@pytest.mark.parametrize(("happens", "cause", "source", "by_itself"), CAUSES)
def test_every_pause_reports_who_ordered_it_and_what_ends_it(
    happens: Callable[[Run], object], cause: int, source: str, by_itself: bool
) -> None:
    run = under_way("mpc")  # which a blocked wheel leads less far off its line
    happens(run)
    run.until(PAUSED)
    assert pause_of(run)[:3] == (cause, source, by_itself)
    run.onboard.abort()
    assert run.onboard.status.pause is None


def test_a_released_emergency_stop_waits_for_a_person() -> None:
    run = under_way()
    run.onboard.estop()
    run.ticks(200)
    run.onboard.reset()
    assert pause_of(run) == Pause(PauseStatus.EMERGENCY_STOP, "emergency stop")
    run.ticks(1000)
    assert run.onboard.state == PAUSED


def test_a_robot_that_goes_on_by_itself_warns_two_seconds_before() -> None:
    run = under_way("mpc")
    without_fix(run)
    assert run.onboard.warning is None
    earliest = pause_of(run).earliest_tick
    assert earliest - run.rig.tick == 100 + WARNING_TICKS, "the fix has to be good for 1 s"
    run.rig.fix = 3
    for _ in range(400):
        if run.onboard.warning is not None:
            break
        run.tick()
    warned_tick, warning = run.rig.tick, run.onboard.warning
    assert warning is not None
    assert (run.onboard.state, warning.reason) == (PAUSED, "goes on by itself")
    assert warning.earliest_tick == pause_of(run).earliest_tick == warned_tick + WARNING_TICKS
    assert any("goes on by itself in 2 s" in event.text for event in run.onboard.take_events())
    assert stand_ticks(run) >= WARNING_TICKS
    assert (run.onboard.state, run.onboard.warning, run.onboard.status.pause) == (RUNNING, warning, None)
    run.until(DONE)
    assert run.onboard.warning is None


def test_a_fix_that_fails_while_it_warns_ends_the_warning() -> None:
    run = under_way()
    without_fix(run)
    run.rig.fix = 3
    while run.onboard.warning is None:
        run.tick()
    run.ticks(150)
    run.rig.fix = 0
    run.ticks(30)
    assert run.onboard.warning is None
    run.ticks(200)
    assert (run.onboard.state, run.command) == (PAUSED, STANDSTILL)


def test_pause_holds_a_robot_that_would_go_on_by_itself() -> None:
    for ticks in (0, 250):  # with the fix still away, and while it warns
        run = under_way()
        without_fix(run)
        run.rig.fix = 3 if ticks else 0
        run.ticks(ticks)
        run.onboard.pause()
        assert pause_of(run) == Pause(PauseStatus.OPERATOR, "operator")
        assert run.onboard.warning is None
        run.rig.fix = 3
        run.ticks(500)
        assert (run.onboard.state, run.command) == (PAUSED, STANDSTILL)
        with pytest.raises(CommandRefused):
            run.onboard.pause()
        run.onboard.resume()
        run.until(DONE)


def test_resume_warns_before_the_robot_moves_off() -> None:
    run = under_way()
    run.onboard.pause()
    run.ticks(300)
    run.onboard.resume()
    warning = run.onboard.warning
    assert warning is not None
    assert (warning.reason, warning.earliest_tick) == ("resumed", run.rig.tick + WARNING_TICKS)
    run.tick()
    assert "about to move" in run.onboard.status.reason
    run.ticks(100)
    run.onboard.pause()
    assert run.onboard.warning is None
    run.ticks(300)
    run.onboard.resume()
    assert stand_ticks(run) >= WARNING_TICKS
    run.until(DONE)
    assert run.onboard.painted.coverage_pct == pytest.approx(100.0)


def test_a_hazard_ends_the_warning() -> None:
    run = under_way()
    run.onboard.pause()
    run.ticks(300)
    run.onboard.resume()
    run.ticks(50)
    run.rig.battery = 0.01
    run.ticks(2)
    assert (run.onboard.state, run.onboard.warning, pause_of(run).source) == (PAUSED, None, "battery-low")


def with_limits(**limits: float) -> Run:
    run = Run(
        Onboard(Vehicle(), OnboardConfig(move_off=MoveOffLimits(**limits))), Rig(Vehicle(), Scenario(noise="none"))
    )
    run.onboard.load(LINE)
    run.onboard.start()
    return run


def test_a_start_warns_as_long_as_it_is_configured_to() -> None:
    run = with_limits(start_warning_s=2.5)
    assert run.onboard.warning == (250, "started")
    assert stand_ticks(run) >= 250
    run.until(DONE)
    shipped = start(LINE)
    assert shipped.onboard.warning == (0, "started"), "it warns, but does not wait"
    assert stand_ticks(shipped) < 100


def test_a_start_where_it_knows_its_place_already_warns_too() -> None:
    run = with_limits(start_warning_s=2.0)
    run.until(DONE)
    run.ticks(200)
    line = trajectory(chain((0.0, 5.0), x=run.rig.x, y=run.rig.y, heading=run.rig.heading))
    run.onboard.take_here(run.onboard.prepare(line))
    run.onboard.start()
    assert stand_ticks(run) >= 200
    run.until(DONE)


def test_a_stop_that_lasts_too_long_waits_for_a_person() -> None:
    run = with_limits(person_after_s=10.0)
    run.until_arc(6.0)
    run.rig.fix = 0
    run.until(PAUSED)
    run.ticks(750)
    assert pause_of(run).ends_by_itself
    run.ticks(300)
    assert not pause_of(run).ends_by_itself
    assert run.onboard.status.reason.startswith("stopped for more than 10 s: the GNSS has no fix")
    run.rig.fix = 3
    run.ticks(1000)
    assert run.onboard.state == PAUSED
    run.onboard.resume()
    run.until(DONE)


def test_it_is_the_move_off_that_must_come_in_time() -> None:
    run = with_limits(person_after_s=10.0)
    run.until_arc(6.0)
    run.rig.fix = 0
    run.until(PAUSED)
    run.ticks(720)
    run.rig.fix = 3  # settled after 8.3 s, and with the warning it would be 10.3 s
    while pause_of(run).ends_by_itself:
        assert run.onboard.warning is None, "it does not warn of what it will not do"
        run.tick()
    run.ticks(500)
    assert run.onboard.state == PAUSED


def test_a_start_that_waits_too_long_for_its_fix_waits_for_a_person() -> None:
    run = with_limits(person_after_s=10.0)
    run.rig.fix = 1
    run.ticks(1010)
    assert run.onboard.state == PAUSED
    assert not pause_of(run).ends_by_itself
    assert "not ready to set off for 10 s" in run.onboard.status.reason
    run.rig.fix = 3
    run.ticks(500)
    assert (run.onboard.state, run.command) == (PAUSED, STANDSTILL)
    run.onboard.resume()
    run.until(DONE)


def test_who_may_go_on_by_itself_after_any_stop() -> None:
    usual = MoveOffLimits()
    assert MoveOffRules(usual, Vehicle()).longest_stop_s == 30.0
    assert MoveOffRules(usual, load_vehicle("clay-roller")).longest_stop_s == 30.0
    assert MoveOffRules(usual, load_vehicle("turtlebot2")).longest_stop_s == float("inf")
    heavy = load_vehicle("turtlebot2").model_copy(
        update={"body": load_vehicle("turtlebot2").body.model_copy(update={"mass_empty_kg": 20.1})}
    )
    assert MoveOffRules(usual, heavy).longest_stop_s == 30.0
    assert MoveOffRules(MoveOffLimits(person_after_s=90.0), heavy).longest_stop_s == 90.0


def test_the_reason_is_what_holds_now() -> None:
    run = under_way()
    without_fix(run)
    assert run.onboard.status.reason.startswith("the GNSS has no fix")
    run.rig.fix = 2
    run.ticks(30)
    assert run.onboard.status.reason.startswith("the GNSS has a float fix")
    run.rig.fix = 3
    while run.onboard.warning is None:
        run.tick()
    run.tick()
    assert "about to move" in run.onboard.status.reason


def test_the_reason_does_not_outlive_a_refill() -> None:
    run = under_way()
    run.rig.tank_l = 0.01
    run.until(PAUSED)
    run.ticks(200)
    assert run.onboard.status.reason == "the tank is all but empty"
    run.rig.tank_l = 20.0
    run.ticks(2)
    assert run.onboard.status.reason == "over: the tank is all but empty; resume to go on"
    run.rig.battery = 0.01
    run.ticks(2)
    assert run.onboard.status.reason.startswith("the battery is low")
    run.rig.battery = 1.0
    run.ticks(2)
    run.onboard.resume()
    run.until(DONE)


def test_a_blocked_wheel_is_not_over_because_it_stands() -> None:
    run = under_way("mpc")
    run.rig.blocked = 0
    run.until(PAUSED)
    reason = run.onboard.status.reason
    run.ticks(300)
    assert run.onboard.status.reason == reason
