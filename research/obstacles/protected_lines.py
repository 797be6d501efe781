"""Protected lines: one robot drives lines among people, by its own protection or by zones, with the same seeds."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import cache
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.vehicles import LidarSpec, Vehicle
from touchline_research.obstacles.crowd import (
    EIGHT,
    INTERCEPTOR,
    OUTLINE,
    PERSON_M,
    STEPPER,
    WALKER,
    Met,
    meet_people,
    protected,
    take_scans,
)
from touchline_research.obstacles.speed_zones import APPROACH, BOXES, CIRCLES, GROWING_CIRCLE, OWN_RULE, SpeedZones
from touchline_research.target_table import TargetRow, TargetTable, against_targets

Progress = Callable[[str, float], None]

LINE_M: Final = 60.0
LONGEST_MIN: Final = 30.0
"""Time after which a line counts as not finished."""
ERROR_M: Final = 0.01
"""Bound on the error of the hits that the robot counts on."""
SCANS: Final = 2000
STOPS_IN_M: Final = 1.22
"""Way to rest from 1.4 m/s at the planned 1 m/s², with the lag and the age of a scan."""


class Rule(NamedTuple):
    """Rule by which a robot drives among people.

    Attributes:
        name: Name of the rule.
        mode: Mode of the robot's protection.
        zones: Zones that are in force instead.
    """

    name: str
    mode: Literal["passive", "protect"] = "passive"
    zones: SpeedZones = OWN_RULE


PASSIVE: Final = Rule("ours: passive")
RULES: Final = (
    PASSIVE,
    Rule("ours: protect", "protect"),
    Rule("stop and wait: 1.27 m ahead", zones=SpeedZones(BOXES, STOPS_IN_M + 0.05, STOPS_IN_M + 0.05)),
    Rule("boxes: stop 0.6 m ahead, 30 % to 1.5 m", zones=SpeedZones(BOXES, 0.6, 1.5)),
    Rule("time to contact at least 2 s", zones=SpeedZones(APPROACH, 0.05, ahead_s=2.0)),
    Rule("circle: stop at 0.6 m, 30 % to 1.5 m", zones=SpeedZones(CIRCLES, 0.6, 1.5)),
    Rule("circle: distances of passive", zones=SpeedZones(GROWING_CIRCLE, 0.05)),
)


class People(NamedTuple):
    """People on the ground of a line.

    Attributes:
        name: Description of them.
        kinds: WALKER, INTERCEPTOR or STEPPER for each.
        least_mps: Mean speed that passive mode must leave; 0: none is asked for.
    """

    name: str
    kinds: tuple[int, ...]
    least_mps: float = 0.0


CROWDS: Final = (
    People("one walker", (WALKER,), 1.1),
    People("four", (WALKER, WALKER, INTERCEPTOR, STEPPER)),
    People("eight adversaries", EIGHT, 0.42),
)


class LineRuns(NamedTuple):
    """Lines driven among the same people by one rule.

    Attributes:
        people: The people.
        rule: The rule.
        met: Contacts, way and time on each line.
        shortest_s: Time of a line without anybody.
        scan_s: Computing time of a scan with eight people, and the ticks until the next.
    """

    people: People
    rule: Rule
    met: tuple[Met, ...]
    shortest_s: float
    scan_s: float

    @property
    def moving(self) -> int:
        """Contacts with the robot in motion."""
        return sum(each.moving for each in self.met)

    @property
    def hours(self) -> float:
        """Time on all lines."""
        return sum(each.time_s for each in self.met) / 3600.0

    @property
    def mean_mps(self) -> float:
        """Mean speed."""
        return sum(each.way_m for each in self.met) / (3600.0 * self.hours)

    def row(self) -> TargetRow:
        """Row of the table."""
        standing, closest = sum(each.standing for each in self.met), min(each.closest_m for each in self.met)
        finished = sum(each.way_m >= LINE_M for each in self.met)
        times = 3600.0 * self.hours / (len(self.met) * self.shortest_s)
        figures = {
            "moving": self.moving,
            "standing": standing,
            "closest_m": closest,
            "mean_mps": self.mean_mps,
            "finished": finished,
            "times_shortest": times,
            "scan_s": self.scan_s,
        }
        asked = []
        if self.rule == PASSIVE:
            asked.append(("no contact in motion", self.moving == 0))
            if self.people.least_mps:
                asked.append((f"≥ {self.people.least_mps:g} m/s", self.mean_mps >= self.people.least_mps))
        cells = (
            self.rule.name,
            self.people.name,
            f"{self.moving}",
            f"{standing}",
            f"{closest:.3f} m" if math.isfinite(closest) and closest > 0.0 else "touches",
            f"{self.mean_mps:.2f} m/s",
            f"{times:.2f}" if finished == len(self.met) else f"{finished} of {len(self.met)} finished",
            f"{1e6 * self.scan_s:.1f} µs",
        )
        return TargetRow(cells, *against_targets(asked), figures)


def marker(mode: Literal["passive", "protect"] = "passive") -> Vehicle:
    """Return the line marker with a lidar that scans all round at once.

    Args:
        mode: Mode of its protection.
    """
    vehicle = load_vehicle("turf-tank-two")
    rules = vehicle.protection.model_copy(update={"mode": mode})
    return vehicle.model_copy(update={"protection": rules, "sensors": (LidarSpec(name="lidar", scan_s=0.0),)})


def drive_line(rule: Rule, kinds: Sequence[int], seed: int) -> Met:
    """Let the marker drive a line.

    Args:
        rule: Its rule.
        kinds: WALKER, INTERCEPTOR or STEPPER for each person.
        seed: Seed of the people.
    """
    vehicle = marker(rule.mode)
    computer = protected(vehicle)
    computer.way.error_m = ERROR_M
    return meet_people(vehicle, computer, kinds, LONGEST_MIN, rule.zones, seed=seed, line_m=LINE_M)


@cache
def scan_seconds(rule: Rule) -> float:
    """Return the computing time [s] of a scan with eight people in reach, and of the ticks until the next."""
    vehicle = marker(rule.mode)
    computer, rng = protected(vehicle), np.random.default_rng(1)
    computer.way.error_m, computer.times.tick = ERROR_M, 0
    places = np.column_stack((rng.uniform(1.5, 6.0, len(EIGHT)), rng.uniform(-3.0, 3.0, len(EIGHT))))
    at = np.linspace(0.0, math.tau, OUTLINE, endpoint=False)
    outline: NDArray[np.float64] = PERSON_M * np.column_stack((np.cos(at), np.sin(at)))
    points = np.ascontiguousarray((places[:, None] + outline).reshape(-1, 2))
    given = computer.array, np.array(vehicle.body.footprint_m), rule.zones, points
    take_scans(*given, 1)
    begun_s = time.process_time()
    take_scans(*given, SCANS)
    return (time.process_time() - begun_s) / SCANS


def drive_lines(lines: int, progress: Progress) -> list[LineRuns]:
    """Drive lines by all rules among all crowds.

    Args:
        lines: Number of lines of each, each with its seed.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    shortest_s = drive_line(PASSIVE, (), 1).time_s
    found: list[LineRuns] = []
    for people in CROWDS:
        for rule in RULES:
            progress(f"{people.name}, {rule.name}", len(found) / (len(CROWDS) * len(RULES)))
            met = tuple(drive_line(rule, people.kinds, seed) for seed in range(1, lines + 1))
            found.append(LineRuns(people, rule, met, shortest_s, scan_seconds(rule)))
    return found


def protection_table(found: Sequence[LineRuns]) -> TargetTable:
    """Return the table of lines."""
    columns = (
        *("rule", "people", "contacts in motion", "at rest", "least distance in motion", "mean speed"),
        *("time / shortest", "computing per scan"),
    )
    return TargetTable(
        f"Protection: {len(found[0].met)} lines of {LINE_M:g} m, 12 m wide, by each rule with the same seeds",
        columns,
        tuple(each.row() for each in found),
        "A marker at 1.4 m/s that brakes at 4 m/s². Of eight people three aim at it at 1.5 m/s, three step out ahead "
        "and two walk at random; of four one aims and one steps out. Who touches it is moved away.",
    )
