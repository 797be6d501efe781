"""Separating planes: strips between robots, and the cells made of them.

Most planes are made at once, one between every two robots of an update, and are kept so, in arrays: a team of 200 has
20,000 of them. Only those of a robot that is late, silent or new are looked at one by one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import BufferedCell, keep_robots_apart

Floats = NDArray[np.float64]


class Plane(NamedTuple):
    """Numbered strip between two robots; `sides` are the half-planes (3,) of either, by its name."""

    number: int
    sides: Mapping[str, Floats]


class PlaneRound:
    """Planes between every two robots of one update, all of the same number.

    Attributes:
        number: Number of each plane; higher than any before.
        places: Row of each robot, by name.
        rows: (n, n, 3) the half-plane that keeps robot i from robot j; zeros for i = j.
    """

    def __init__(self, number: int, segments: Mapping[str, Floats], radius_m: float) -> None:
        """Compute the planes.

        Args:
            number: Number of each.
            segments: (4,) S of each robot by its name (m).
            radius_m: r_s.

        Raises:
            SegmentsMeet: Nothing keeps two of the robots apart.
        """
        self.number = number
        self.places = {name: place for place, name in enumerate(segments)}
        self._looked_at: dict[tuple[str, str], Plane] = {}
        self.rows = np.zeros((len(segments), len(segments), 3))
        keep_robots_apart(np.array(list(segments.values())).reshape(-1, 4), radius_m, self.rows, list(segments))

    def plane(self, first: str, second: str) -> Plane:
        """Return the plane between two of the robots."""
        pair = (first, second) if first < second else (second, first)
        if (found := self._looked_at.get(pair)) is None:
            one, other = self.places[first], self.places[second]
            found = Plane(self.number, {first: self.rows[one, other], second: self.rows[other, one]})
            self._looked_at[pair] = found
        return found

    def among(self, names: Sequence[str]) -> Floats:
        """Return (m, m, 3) the rows of some of the robots, in this order."""
        places = [self.places[name] for name in names]
        return self.rows[np.ix_(places, places)]


@dataclass
class MadeCell:
    """Cell that a robot may be using, and the planes that it is made of.

    Attributes:
        name: Name of the robot.
        cell: The cell as sent to it.
        own: Planes with each robot that is no mate, by its name.
        rounds: Rounds with a plane to each mate, the newest last, in which the cell was made.
        mates: Robots with which it has planes of these rounds, and no others; it may be one itself.
        dead: Whether the robot does not drive in it any more, but rests somewhere in it.
    """

    name: str
    cell: BufferedCell
    own: Mapping[str, Sequence[Plane]]
    rounds: tuple[PlaneRound, ...] = ()
    mates: frozenset[str] = frozenset()
    dead: bool = False

    def planes(self, other: str) -> Sequence[Plane]:
        """Return the planes with another robot, of those that it was made to keep off."""
        if other in self.mates:
            return [each.plane(self.name, other) for each in self.rounds]
        return self.own[other]

    def shared(self, other: MadeCell) -> Plane | None:
        """Return the newest plane that its robot keeps to with this cell, and another robot with that."""
        numbers = {plane.number for plane in other.planes(self.name)}
        common = [plane for plane in self.planes(other.name) if plane.number in numbers]
        return max(common, key=lambda plane: plane.number, default=None)
