"""Crossings of wet paint between robots: wheels and casters of one on lines of another."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.plan import Plan
from touchline.services.planner.sequencing.wet_paint import BEGUN, NO_LINES, SPEED, Wheels, wet_rows


class Clocked(NamedTuple):
    """A plan, and the time of its robot along it.

    Attributes:
        plan: The plan.
        clock_s: Times (n,) at which the robot reaches arc lengths (n,) of what is sent, on a clock that all share.
    """

    plan: Plan
    clock_s: Callable[[Floats], Floats]


def crossings_between(works: Sequence[Clocked], wheels: Wheels, before: Floats = NO_LINES) -> int:
    """Count the crossings of wet paint of other robots, or of earlier lines, by all robots.

    Args:
        works: Plans of the robots.
        wheels: Wheels and casters of each robot.
        before: (n, 7) rows of `sequencing.wet_paint`: lines that are on the ground already.
    """
    painted = [painted_rows_of(work) for work in works]
    count = 0
    for robot, work in enumerate(works):
        others = np.concatenate([before, *(rows for k, rows in enumerate(painted) if k != robot)])
        count += crossings_of(work, wheels, others)
    return count


def painted_rows_of(work: Clocked) -> Floats:
    """Rows (n, 7) of `sequencing.wet_paint` of the lines that a robot paints."""
    lines = [line for line in work.plan.sent if line.stroke]
    rows = wet_rows(line.stroke.nozzle for line in lines if line.stroke)
    begun_s = work.clock_s(np.array([line.start_m for line in lines]))
    ended_s = work.clock_s(np.array([line.end_m for line in lines]))
    rows[:, BEGUN] = begun_s
    rows[:, SPEED] = [line.stroke.nozzle.length_m for line in lines if line.stroke] / (ended_s - begun_s)
    return rows


def crossings_of(work: Clocked, wheels: Wheels, painted: Floats) -> int:
    """Number of crossings of lines along a robot's path."""
    sent, count, ideal_m = work.plan.sent, 0, 0.0
    ideal_at = np.array([0.0, *(line.ideal_to_m for line in sent)])
    sent_at = np.array([0.0, *(line.end_m for line in sent)])
    for section in work.plan.sections:
        ends_m = np.array((ideal_m, ideal_m + section.path.length_m))
        begun_s, ended_s = work.clock_s(np.interp(ends_m, ideal_at, sent_at)).tolist()
        count += int(wheels.crossings(section.path, begun_s, ended_s - begun_s, painted).sum())
        ideal_m = float(ends_m[1])
    return count
