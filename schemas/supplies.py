"""Compares the paint and energy that a plan needs with the levels of tank and battery."""

from __future__ import annotations

import math
from dataclasses import dataclass

from touchline.schemas.messages.plan_messages import PlanReport
from touchline.schemas.vehicles import Vehicle

LOW_TANK_L = 0.03
"""At this level the robot stops by itself, with some four metres of line left: an empty nozzle would sputter."""
LOW_BATTERY = 0.08
"""At this charge, a share of the whole, the robot stops by itself."""

_TIMES = {1: "once", 2: "twice"}


@dataclass(frozen=True)
class Supply:
    """Need and level of one supply, both in its unit (L or Wh); None if unknown.

    Attributes:
        full: What is there after a refill.
        reserve: With no more than this the robot stops.
    """

    needed: float | None
    there: float | None
    full: float
    reserve: float

    @property
    def lasts(self) -> bool:
        """True if it lasts to the end of the job, as far as is known."""
        return self.needed is None or self.there is None or self.needed <= self.there - self.reserve

    @property
    def refills(self) -> int:
        """Number of refills during the job, each when nothing usable remains."""
        if self.lasts or self.needed is None or self.there is None:
            return 0
        missing = self.needed - max(self.there - self.reserve, 0.0)
        return math.ceil(missing / max(self.full - self.reserve, 1e-9) - 1e-9)


@dataclass(frozen=True)
class Supplies:
    """Tank (L) and battery (Wh) against a job."""

    paint: Supply
    battery: Supply

    @property
    def last(self) -> bool:
        """True if both last to the end of the job, as far as is known."""
        return self.paint.lasts and self.battery.lasts

    @property
    def unknown(self) -> tuple[str, ...]:
        """Need of a supply whose level is unknown, in words."""
        told = []
        if self.paint.needed is not None and self.paint.there is None:
            told.append(f"needs {_amount(self.paint.needed)} L of paint, and the level of the tank is unknown")
        if self.battery.needed is not None and self.battery.there is None:
            told.append(f"needs {_amount(self.battery.needed)} Wh, and the charge of the battery is unknown")
        return tuple(told)

    @property
    def shortages(self) -> tuple[str, ...]:
        """Supplies that will run out, and the remedy, in words."""
        told, tank, battery = [], self.paint, self.battery
        if not tank.lasts:
            told.append(
                f"needs {_amount(tank.needed)} L of paint, the tank has {_amount(tank.there)} L: "
                f"refill it {times(tank.refills)}"
            )
        if not battery.lasts:
            told.append(
                f"needs {_amount(battery.needed)} Wh, the battery has {_amount(battery.there)} Wh, of which it keeps "
                f"{_amount(battery.reserve)} Wh: change it {times(battery.refills)}"
            )
        return tuple(told)


def supplies(
    report: PlanReport | None, vehicle: Vehicle, tank_l: float | None = None, charge: float | None = None
) -> Supplies:
    """A plan (None if nothing is known of it) against a tank's level and a battery's charge, a share 0…1 of the whole.

    What is given as None, or is not a finite number, is not known.
    """
    charge = _known(charge)
    return Supplies(
        Supply(_needed(report.paint_l if report else None), _known(tank_l), vehicle.tool.capacity_l, LOW_TANK_L),
        Supply(
            _needed(report.battery_wh if report else None),
            None if charge is None else charge * vehicle.body.battery_wh,
            vehicle.body.battery_wh,
            LOW_BATTERY * vehicle.body.battery_wh,
        ),
    )


def full(report: PlanReport, vehicle: Vehicle) -> Supplies:
    """A plan against a tank and a battery that are full."""
    return supplies(report, vehicle, vehicle.tool.capacity_l, 1.0)


def times(count: int) -> str:
    """Once, twice, 3 times."""
    return _TIMES.get(count, f"{count} times")


def _amount(value: float | None) -> str:
    """With a tenth at most, but two digits at least."""
    if value is None:
        return "?"
    return f"{value:.2g}" if abs(value) < 1.0 else f"{value:.1f}" if abs(value) < 100.0 else f"{value:.0f}"


def _known(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _needed(estimate: float | None) -> float | None:
    """An estimate; a planner that makes none leaves it at 0."""
    value = _known(estimate)
    return value if value else None
