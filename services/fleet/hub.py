"""The coordinator's end of links that lose messages: makes numbered cells by the rules of `links.py`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.fleet.cells import BufferedCell, SegmentsMeet, within_area
from touchline.services.fleet.coordinator import Aiming, TeamSettings
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.kernels.partition import between
from touchline.services.fleet.links import FIRST_CELL, NumberedCell, Whereabouts
from touchline.services.fleet.resting import strip_off, where_it_rests
from touchline.services.fleet.tasks import TeamTask

Floats = NDArray[np.float64]

SILENT_S: Final = 1.0
CELLS_MOST: Final = 8
"""So many cells that a robot may be using are enough: until it says which, no more are made."""


class _Plane(NamedTuple):
    """A strip between two robots, numbered; `sides` are the half-planes (3,) of either, by its name."""

    number: int
    sides: Mapping[str, Floats]


@dataclass
class _MadeCell:
    """A cell that a robot may be using, and the planes that it is made of, by the other robot's name."""

    cell: BufferedCell
    planes: Mapping[str, Sequence[_Plane]]
    dead: bool = False

    def shared(self, other: _MadeCell, name: str, others_name: str) -> _Plane | None:
        """The newest plane that robot `name` keeps to with this cell, and `others_name` with that."""
        numbers = {plane.number for plane in other.planes[name]}
        common = [plane for plane in self.planes[others_name] if plane.number in numbers]
        return max(common, key=lambda plane: plane.number, default=None)


@dataclass
class _Robot:
    """What the hub knows of one robot.

    Attributes:
        newest: The message with its newest stamp.
        heard_s: When that came.
        using: The cells that it may be using, by their numbers.
        echo_s: The newest stamp that counts.
        sent: What it is told.
        rests_within_m: If it is at rest: how far from the newest S at most.
    """

    newest: Whereabouts
    heard_s: float
    using: dict[int, _MadeCell]
    echo_s: float
    sent: NumberedCell
    rests_within_m: float | None = None

    @property
    def adopted(self) -> _MadeCell:
        """The cell that it has last said to keep to."""
        return self.using[self.newest.adopted]


class Hub:
    """Cells and targets for a team whose messages may be lost, late, doubled or out of order.

    A robot that begins anew, without the cell that it has adopted, is not listened to any more: it stays an obstacle
    until there is a new hub.
    """

    def __init__(
        self,
        area: FreeArea,
        task: TeamTask,
        starts: Sequence[Whereabouts],
        now_s: float = 0.0,
        settings: TeamSettings | None = None,
    ) -> None:
        """With all robots at rest.

        Args:
            area: Where they drive.
            task: What for.
            starts: Where each one stands, from all of them.
            now_s: Of the hub's clock.
            settings: What they have in common.

        Raises:
            SegmentsMeet: Two stand at the same place.
        """
        self._area, self._aiming, self._settings = area, Aiming(task), settings or TeamSettings()
        self._planes_made, self._cells_made = 0, FIRST_CELL
        known = {each.name: each for each in sorted(starts, key=lambda each: each.name)}
        planes = self._new_planes(known)
        self._robots = {}
        for name, each in known.items():
            made = self._cell(each, {other: [planes[frozenset((name, other))]] for other in known if other != name})
            x, y = each.segment[:2].tolist()
            sent = NumberedCell(name, FIRST_CELL, made.cell, (x, y), each.stamp_s)
            self._robots[name] = _Robot(each, now_s, {FIRST_CELL: made}, each.stamp_s, sent)

    def receive(self, message: Whereabouts, now_s: float) -> None:
        """Take a message, in whatever order they come.

        Args:
            message: From a robot of the team.
            now_s: Of the hub's clock.
        """
        robot = self._robots[message.name]
        if message.stamp_s <= robot.newest.stamp_s or message.adopted not in robot.using:
            return
        if robot.rests_within_m is not None and message.stamp_s < robot.echo_s + self._settings.resting_s:
            return  # it is from before the robot came to rest, elsewhere
        robot.newest, robot.heard_s = message, now_s
        robot.using = {
            number: made
            for number, made in robot.using.items()
            if number == message.adopted or number > message.decided
        }
        if robot.rests_within_m is not None:
            robot.rests_within_m = 0.0 if any(made.dead for made in robot.using.values()) else None
        if robot.rests_within_m is None:
            robot.echo_s = message.stamp_s

    def update(self, now_s: float) -> None:
        """Make new cells; to be asked once a period.

        Args:
            now_s: Of the hub's clock.

        Raises:
            SegmentsMeet: A robot is about to run into another or a wall: it has not kept to its cell.
        """
        self._look_for_silence(now_s)
        told = {
            name: robot.newest
            for name, robot in self._robots.items()
            if now_s - robot.heard_s <= SILENT_S and len(robot.using) < CELLS_MOST
        }
        new = self._new_planes(told)
        made = {name: self._cell(each, self._planes_of(name, new)) for name, each in told.items()}
        names = list(self._robots)
        places = np.array([robot.newest.segment[:2] for robot in self._robots.values()])
        cells = [(made.get(name) or robot.adopted).cell for name, robot in self._robots.items()]
        aims = self._aiming.aims(names, places, cells)
        self._cells_made += 1
        for name, one in made.items():
            robot = self._robots[name]
            robot.using[self._cells_made] = one
            robot.sent = NumberedCell(name, self._cells_made, one.cell, aims[name].target_m, robot.echo_s)

    def say(self) -> list[NumberedCell]:
        """What to tell the robots now: the same again, until there is something new."""
        return [robot.sent._replace(echo_s=robot.echo_s) for robot in self._robots.values()]

    @property
    def resting(self) -> frozenset[str]:
        """Who has been silent for so long that it is but an obstacle."""
        return frozenset(name for name, robot in self._robots.items() if robot.rests_within_m is not None)

    def _look_for_silence(self, now_s: float) -> None:
        settings = self._settings
        for robot in self._robots.values():
            if robot.rests_within_m is None and now_s - robot.heard_s >= max(SILENT_S, settings.resting_s):
                braking_m = settings.speed_max_mps**2 / (2.0 * settings.deceleration_mps2)
                robot.rests_within_m = settings.speed_max_mps * settings.lease_s + braking_m
                for made in robot.using.values():
                    made.dead = True

    def _new_planes(self, told: Mapping[str, Whereabouts]) -> dict[frozenset[str], _Plane]:
        """A new plane for every two of some robots."""
        names, found = list(told), {}
        for k, first in enumerate(names):
            for second in names[k + 1 :]:
                strip = between(told[first].segment, told[second].segment, self._settings.radius_m)
                found[frozenset((first, second))] = self._numbered(first, second, strip)
        return found

    def _numbered(self, first: str, second: str, strip: tuple[float, float, float, float]) -> _Plane:
        """The plane of a strip.

        Raises:
            SegmentsMeet: It has no normal: nothing keeps the two apart.
        """
        x, y, mine, others = strip
        if x == 0.0 and y == 0.0:
            raise SegmentsMeet(first, second)
        self._planes_made += 1
        sides = {first: np.array((x, y, mine)), second: np.array((-x, -y, -others))}
        return _Plane(self._planes_made, sides)

    def _planes_of(self, name: str, new: Mapping[frozenset[str], _Plane]) -> dict[str, list[_Plane]]:
        """What a robot's new cell is made of: a plane with each cell that another may be using, and the new ones."""
        found = {}
        for other, robot in self._robots.items():
            if other != name:
                planes = {
                    bond.number: bond for bond in (self._bond(name, other, each) for each in robot.using.values())
                }
                if fresh := new.get(frozenset((name, other))):
                    planes[fresh.number] = fresh
                found[other] = list(planes.values())
        return found

    def _bond(self, name: str, other: str, made: _MadeCell) -> _Plane:
        """What keeps a robot off another that may be using this cell."""
        robot = self._robots[name]
        if made.dead:
            resting = self._robots[other]
            there = where_it_rests(made.cell, resting.newest.segment, resting.rests_within_m or 0.0)
            strip = strip_off(robot.newest.segment, there, 2.0 * self._settings.radius_m)
            return self._numbered(name, other, strip)
        # Only a robot that comes back may have no plane in common with it, but was kept off by one of that cell's.
        return robot.adopted.shared(made, name, other) or max(made.planes[name], key=lambda plane: plane.number)

    def _cell(self, told: Whereabouts, planes: Mapping[str, Sequence[_Plane]]) -> _MadeCell:
        sides = [plane.sides[told.name] for some in planes.values() for plane in some]
        rows = np.zeros((1, len(sides) + len(self._area.sides) + len(self._area.walls), 3))
        if sides:
            rows[0, : len(sides)] = sides
        (cell,) = within_area(told.segment[None], self._area, self._settings.radius_m, rows, [told.name])
        return _MadeCell(cell, planes)
