"""Switching of valve and discs, so that paint begins and ends exactly at the ends of lines."""

from collections.abc import Sequence
from typing import NamedTuple

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import Actuation
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.speed.timing import SpeedProfile

# Lines that follow each other this closely (m) are painted without a break.
JOINT_M = 1e-6
MASKS = {"SPRAY": Actuation.SPRAY, "DISC_SPRAY": Actuation.DISC_SPRAY}


class PaintedStretch(NamedTuple):
    """Interval of arc length (m) in which a template segment is painted, and the actuation."""

    segment_id: str
    start_m: float
    end_m: float
    actuation: str


class Switch(NamedTuple):
    """Actuation bits `mask` that hold from `station_m` on."""

    station_m: float
    mask: int


def actuation_profile(painted: Sequence[PaintedStretch], speeds: SpeedProfile, vehicle: Vehicle) -> list[Switch]:
    """Compute the switches in order of arc length; everything is off at both ends.

    Valve and discs are commanded ahead of a line by their delays; the discs stay down until its end. A vehicle that
    does not paint has no switches.

    Args:
        painted: Painted stretches in driving order.
        speeds: Speeds along what is sent.
        vehicle: Vehicle with its delays.

    Raises:
        PlanningError: A line takes less time than the valve needs.
    """
    if not vehicle.tool.paints:
        return _switches([])
    changes: list[tuple[float, int, int]] = []
    for line in _in_one_go(painted):
        mask = MASKS[line.actuation]
        begin, end = speeds.time_at(line.start_m), speeds.time_at(line.end_m)
        opened = speeds.station_at(begin - vehicle.tool.opens_s)
        closed = speeds.station_at(end - vehicle.tool.closes_s)
        if closed <= opened:
            raise PlanningError(
                line.segment_id,
                f"is {1e3 * (line.end_m - line.start_m):.0f} mm long, painted before the valve can close",
                "make it longer or lower the paint speed",
            )
        changes += (opened, mask & Actuation.SPRAY, 1), (closed, mask & Actuation.SPRAY, -1)
        if mask & Actuation.DISC:
            lowered = speeds.station_at(begin - vehicle.tool.lowers_s)
            changes += (lowered, Actuation.DISC, 1), (line.end_m, Actuation.DISC, -1)
    return _switches(changes)


def _in_one_go(painted: Sequence[PaintedStretch]) -> list[PaintedStretch]:
    lines: list[PaintedStretch] = []
    for line in painted:
        last = lines[-1] if lines else None
        if last and last.actuation == line.actuation and line.start_m - last.end_m <= JOINT_M:
            lines[-1] = last._replace(end_m=line.end_m)
        else:
            lines.append(line)
    return lines


def _switches(changes: list[tuple[float, int, int]]) -> list[Switch]:
    """Union of intervals given by their ends (arc length, bits, +1 or -1)."""
    switches = [Switch(0.0, Actuation.NONE)]
    depth = {Actuation.SPRAY: 0, Actuation.DISC: 0}
    for station, bits, step in sorted(changes, key=lambda change: (change[0], -change[2])):
        depth[bits] += step
        mask = sum(each for each, count in depth.items() if count)
        if station == switches[-1].station_m:
            switches.pop()
        if not switches or switches[-1].mask != mask:
            switches.append(Switch(station, mask))
    return switches
