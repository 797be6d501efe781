"""The table of hazards: its order, and a further row, which is all that a further hazard takes."""

from __future__ import annotations

from functools import partial

import pytest

from tests.onboard.rig import Run
from tests.onboard.test_hazards import at
from touchline.core.jit import kernel
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.hazards import (
    EMERGENCY,
    HAZARDS,
    LASTS,
    PASSES,
    BatteryFlat,
    Hazard,
    HazardContext,
    SafetyMoment,
    by_code,
)
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Event, PauseStatus, TraversalStatus
from touchline.schemas.vehicles import Vehicle

pytestmark = pytest.mark.xdist_group("own hazard")  # with it the table is compiled anew, in one worker


class HalfCharged(Hazard):
    """Half of the charge is gone."""

    name = "half-charged"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        return 1 if c.frame.battery_fraction < 0.5 else 0

    def words(self, seen: HazardContext, _which: int) -> str:
        return f"only {100.0 * seen.findings.battery_fraction:.0f} % are left"


def run_with(monkeypatch: pytest.MonkeyPatch, hazard: Hazard) -> Run:
    failsafe = partial(Failsafe, hazards=(*HAZARDS, hazard))
    monkeypatch.setattr("touchline.onboard.computer.Failsafe", failsafe)
    return at(7.0)


def test_the_table_is_in_order_of_priority() -> None:
    assert [(hazard.answer, hazard.code, hazard.name, hazard.by) for hazard in HAZARDS] == [
        (EMERGENCY, 1, "bumper", PauseStatus.HAZARD),
        (EMERGENCY, 2, "fence", PauseStatus.HAZARD),
        (LASTS, 3, "operator not heard", PauseStatus.LINK),
        (LASTS, 4, "tank-empty", PauseStatus.HAZARD),
        (LASTS, 5, "tank-low", PauseStatus.HAZARD),
        (LASTS, 6, "battery-low", PauseStatus.HAZARD),
        (LASTS, 21, "valve-leaks", PauseStatus.HAZARD),
        (PASSES, 22, "actuator", PauseStatus.HAZARD),
        (PASSES, 20, "too-little-paint", PauseStatus.HAZARD),
    ]


def test_a_further_row_stops_the_robot_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_with(monkeypatch, HalfCharged(100, LASTS))
    run.onboard.take_events()
    run.rig.battery = 0.4
    run.tick()
    assert run.onboard.state == TraversalStatus.PAUSED
    assert run.onboard.status.reason == "only 40 % are left"
    assert [event.severity for event in run.onboard.take_events() if "40 %" in event.text] == [Event.ERROR]
    run.ticks(150)
    with pytest.raises(CommandRefused, match="only 40 % are left"):
        run.onboard.resume()
    run.rig.battery = 1.0
    run.tick()
    run.onboard.resume()
    assert run.onboard.state == TraversalStatus.RUNNING


def test_it_comes_after_those_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_with(monkeypatch, HalfCharged(100, LASTS))
    run.rig.battery = 0.05
    run.tick()
    assert run.onboard.status.reason == "the battery is low (5 %)"


@pytest.mark.full  # the table is compiled once more
def test_a_further_emergency_latches(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_with(monkeypatch, HalfCharged(100, EMERGENCY))
    run.rig.battery = 0.4
    run.tick()
    assert run.onboard.state == TraversalStatus.ESTOPPED
    run.rig.battery = 1.0
    run.ticks(150)
    assert run.onboard.state == TraversalStatus.ESTOPPED


@pytest.mark.parametrize("code", [0, 6, 23])
def test_a_code_that_is_taken_is_refused(code: int) -> None:
    with pytest.raises(ValueError, match=f"has the code {code}, which is taken"):
        Failsafe(Vehicle(), ComputerState.sized(2)(), 1.0, (*HAZARDS, HalfCharged(code, PASSES)))


def test_every_code_has_its_row() -> None:
    rows = by_code(HAZARDS)
    assert isinstance(rows[6], BatteryFlat)
    assert sorted(rows) == sorted({*range(1, 7), 20, 21, *range(22, 22 + HAZARDS[7].codes)})
