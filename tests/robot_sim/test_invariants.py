"""The check of the invariants can fail: with a guard taken out, each of them is seen to be broken."""

from __future__ import annotations

import pytest

from benchmarks._invariants import Broken, Guarded, fault
from touchline.onboard.control.follower import Asking, answered
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.mission import Mission
from touchline.onboard.executive.sprayer import Sprayer
from touchline.onboard.executive.stop import TraversalStop
from touchline.onboard.executive.traversal import Traversal
from touchline.onboard.interface import Command
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import FenceLimits
from touchline.services.robot_sim.world.world import TruePose

RUNNING = TraversalStatus.RUNNING


def release(traversal: Traversal, tick: int) -> Asking[Command]:
    """As `Traversal.step`, but the emergency stop does not latch."""
    command = yield from STEP(traversal, tick)
    if traversal.state == TraversalStatus.ESTOPPED:
        traversal.state = RUNNING
    return command


def stop_gently(job: Mission) -> Command:
    """As `Mission.rest`, for a follower that is asked at once."""
    return answered(REST(job), job.driver._follower)


def rest_spraying(job: Mission) -> Asking[Command]:
    """As `Mission.rest`, with the valve open."""
    return (yield from REST(job))._replace(valve=True)


def sprays_on(sprayer: Sprayer, arc_length_m: float, *_: float) -> tuple[bool, float]:
    """From the first line on the valve stays open."""
    sprayer.state.valve = arc_length_m >= 3.0
    return sprayer.valve, 0.0


STEP = Traversal.step
REST = Mission.rest
OUT = {"start_s": 6.5, "duration_s": 4.0}
QUIET, NOTHING = (lambda *_: ""), (lambda *_: None)
# what is broken, the guards that are taken out and what is put in their place, the fault, what the operator does
GUARDS = [
    ("without an RTK fix", {(LocalizationMonitor, "paint_problem"): QUIET}, "gnss-outage", None),
    (
        "against the fixes",
        {(LocalizationMonitor, "paint_problem"): QUIET, (LocalizationMonitor, "drive_problem"): QUIET},
        "gnss-wrong-fix",
        None,
    ),
    ("on slipping wheels", {(LocalizationMonitor, "paint_problem"): QUIET}, "wheel-slip", None),
    ("without an operator", {(Failsafe, "stop"): property(QUIET)}, "operator-lost", None),
    ("pressed bumper", {(Traversal, "_heed_hazards"): NOTHING}, "bumper", None),
    ("left the emergency stop", {(Traversal, "step"): release}, None, "estop"),
    ("wheels commanded while stopped", {(Mission, "stop_hard"): stop_gently}, None, "estop"),
    ("while not running", {(Mission, "rest"): rest_spraying}, None, "pause"),
    ("moves without a warning", {(TraversalStop, "_warn"): NOTHING}, None, "pause"),
    (
        "outside what the plan sprays",
        {(Sprayer, "step"): sprays_on},
        None,
        None,
    ),
]


@pytest.mark.parametrize(("broken", "guards", "kind", "order"), GUARDS, ids=[broken for broken, *_ in GUARDS])
def test_without_its_guard_an_invariant_breaks(monkeypatch, broken, guards, kind, order) -> None:
    """With them none does: `test_fault_behaviour` has the same faults and orders."""
    for (room, guard), instead in guards.items():
        monkeypatch.setattr(room, guard, instead)
    faults = (fault(kind, **OUT),) if kind else ()
    with pytest.raises(Broken, match=broken):
        Guarded(faults, follower="pure-pursuit", orders={700: order} if order else {}).run(1500)


@pytest.mark.parametrize("guarded", [True, False])
def test_without_the_fence_a_robot_that_is_carried_off_goes_on(monkeypatch, guarded: bool) -> None:
    run = Guarded((), follower="pure-pursuit", patient=False, fence=FenceLimits(margin_m=0.2))
    run.run(700)
    emulator = run.emulator
    east, north, heading = emulator.world.pose
    emulator.world.place(TruePose(east, north - 1.0, heading))
    emulator.onboard._estimator.ring.states[:, 1] -= 1.0  # type: ignore[attr-defined]
    if guarded:
        assert run.run(200) == TraversalStatus.ESTOPPED
        return
    monkeypatch.setattr(Failsafe, "emergency", property(QUIET))
    with pytest.raises(Broken, match="beyond the fence"):
        run.run(200)
