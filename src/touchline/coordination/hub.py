"""Coordinator of a team: cells and targets, over links that may lose, delay, double and reorder messages.

A robot reports where it is (`Whereabouts`): a stamp of its own clock, its stopping segment S, and which cell it keeps
to. The hub answers where it may be (`Guidance`): a cell with a number, a target, and an echo of a stamp. Of a cell's
half-planes each belongs to a numbered plane between two robots, of whose other side the other's cell may be.

A robot (`onboard/executive/guided.py`):

1. keeps to one cell, the one it has *adopted*, by the cells' rule of motion;
2. looks at a cell only if its number is higher than that of any it has looked at (*decided*), and adopts it if S as it
   is then lies in it, else never;
3. drives only while its clock is within the *lease* of the newest stamp that has been echoed to it, else it brakes;
4. reports with S which number it has adopted, and up to which it has decided.

The hub:

1. holds for each robot the cells that it *may be using*: the one that it has last reported as adopted, and all
   that were made since the highest number that it had decided by then;
2. makes a new cell only of half-planes such that for every other robot, each cell which that one may be using shares a
   plane with it;
3. echoes the newest stamp that it has. A robot of which it has heard nothing newer for a second gets no more cells;
   after the lease and the time to brake it is *at rest*: all cells that it may be using are dead, it stands in one of
   them within reach of its last S, and for others that much is an obstacle;
4. ignores what a robot sent before it came to rest. When one at rest is heard again, it makes it cells by rule 2,
   and echoes its stamps again only when it has adopted one of these. One that joins is at rest, too, until all cells
   that others may be using keep off it.

So any two robots that may drive keep to the two sides of one and the same plane, whatever has been lost.
docs/explanation/teams.md has the proof, and shows
why a simpler rule fails, by which each of two robots goes on to the newest plane for which it has the other's S.
"""

from __future__ import annotations

import cmath
import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cell_targets import CellTargets
from touchline.coordination.cells import ROBOT_RADIUS_M, BufferedCell, SegmentsMeet, within_area
from touchline.coordination.free_area import FreeArea
from touchline.coordination.interventions import Interventions
from touchline.coordination.kernels.nearest import nearest_in
from touchline.coordination.kernels.partition import least_apart_m
from touchline.coordination.resting_robots import strip_off, where_it_rests
from touchline.coordination.separating_planes import MadeCell, Plane, PlaneRound
from touchline.coordination.tasks import TeamTask
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.messages.team_messages import FIRST_CELL, NOTHING_HEARD_S

Floats = NDArray[np.float64]

SILENT_S: Final = 1.0
CELLS_MOST: Final = 8
_DRIVES_M: Final = 1e-3
"""Distance to the stopping point from which on it shows where a robot is heading."""
"""Most cells that a robot may be using: until it reports which, no more are made."""


@dataclass(frozen=True)
class TeamSettings:
    """Common settings of a team's robots.

    Attributes:
        radius_m: r_s: the body's radius, three standard deviations of the estimate, the follower's error, and the
            distance
            driven during the delay of a pose.
        wall_radius_m: Distance of a centre from walls within the area: the body's radius, twice what r_s has beyond it,
            as between two bodies, and the uncertainty of a cell.
        deceleration_mps2: Least deceleration when braking.
        speed_max_mps: Largest speed.
        lease_s: Time for which a robot may drive on without being heard: a round trip by the slowest messages and the
            loss of a few. The shorter, the sooner others may pass a silent one.
    """

    radius_m: float = ROBOT_RADIUS_M
    wall_radius_m: float = ROBOT_RADIUS_M
    deceleration_mps2: float = 0.5
    speed_max_mps: float = 0.5
    lease_s: float = 2.4

    @property
    def resting_s(self) -> float:
        """Time of silence after which a robot is at rest: the lease, and the time to brake."""
        return self.lease_s + self.speed_max_mps / self.deceleration_mps2


@dataclass
class _Robot:
    """The hub's knowledge of one robot.

    Attributes:
        newest: The message with its newest stamp.
        heard_s: Time of its arrival.
        using: Cells that it may be using, by their numbers.
        echo_s: The newest valid stamp.
        sent: Its last guidance.
        rests_within_m: If it is at rest: largest distance from the newest S.
        since: The last cell that was made before it joined.
        heading_rad: Direction in which it last drove.
    """

    newest: Whereabouts
    heard_s: float
    using: dict[int, MadeCell]
    echo_s: float
    sent: Guidance
    rests_within_m: float | None = None
    since: int = FIRST_CELL - 1
    heading_rad: float = 0.0

    @property
    def segment(self) -> Floats:
        """(4,) S, as last reported (m)."""
        return _segment(self.newest)

    @property
    def listened_to(self) -> bool:
        """True if it needs and may get further cells."""
        return len(self.using) < CELLS_MOST

    @property
    def adopted(self) -> MadeCell:
        """The cell that it has last reported as adopted."""
        return self.using[self.newest.adopted]

    def uses_only(self, last: PlaneRound) -> bool:
        """Return whether the only cell that it may be using was made with these planes, and it drives in that."""
        return len(self.using) == 1 and not self.adopted.dead and last in self.adopted.rounds[-1:]


class Hub:
    """Cells and targets for a team whose messages may be lost, late, doubled or out of order.

    A restarted robot, without the cell that it has adopted, is ignored: it stays an obstacle until there is a new hub.
    """

    def __init__(
        self,
        area: FreeArea,
        task: TeamTask,
        starts: Mapping[str, Whereabouts],
        now_s: float = 0.0,
        settings: TeamSettings | None = None,
    ) -> None:
        """Start with all robots without a cell, so that they brake on their stopping segments or stand.

        Args:
            area: The area.
            task: The task.
            starts: Where each robot is without a cell, and would stop, by its name.
            now_s: Hub's clock.
            settings: Common settings.

        Raises:
            SegmentsMeet: Two stand at the same place.
        """
        self.settings = settings or TeamSettings()
        self._area, self._aiming = area, CellTargets(task, self._speed_towards)
        self._planes_made, self._cells_made = 0, FIRST_CELL
        known = {name: starts[name] for name in sorted(starts)}
        self._round, mates = self._new_round(known), frozenset(known)
        self._robots: dict[str, _Robot] = {}
        for place, (name, each) in enumerate(known.items()):
            cell = self._cell(name, each, np.delete(self._round.rows[place], place, axis=0))
            made = MadeCell(name, cell, {}, (self._round,), mates)
            self._robots[name] = _Robot(each, now_s, {FIRST_CELL: made}, each.stamp_s, _stays(each, FIRST_CELL))

    def set_task(self, task: TeamTask) -> None:
        """Continue with another task."""
        self._aiming = CellTargets(task, self._speed_towards)

    def join(self, name: str, there: Whereabouts, now_s: float) -> None:
        """Add another robot, which stands and has no cell; it drives once all others keep off it.

        Driving robots learn of it by the next message: it must not be put down where they could not stop any more.

        Args:
            name: Its name, which must be new.
            there: Where it stands.
            now_s: Hub's clock.
        """
        nowhere = MadeCell(name, BufferedCell(np.zeros((0, 3)), np.zeros((0, 2))), {}, dead=True)
        guidance = _stays(there, FIRST_CELL)
        self._robots[name] = _Robot(there, now_s, {FIRST_CELL: nowhere}, -np.inf, guidance, 0.0, self._cells_made)
        self._robots = {each: self._robots[each] for each in sorted(self._robots)}

    def leave(self, name: str) -> None:
        """Remove a robot that was carried off its place: nobody keeps off it any more."""
        del self._robots[name]

    def receive(self, name: str, message: Whereabouts, now_s: float) -> None:
        """Take a message, in any order.

        Args:
            name: The sender, a robot of the team.
            message: The message.
            now_s: Hub's clock.
        """
        robot = self._robots[name]
        if message.stamp_s <= robot.newest.stamp_s or message.adopted not in robot.using:
            return
        if robot.rests_within_m is not None and message.stamp_s < robot.echo_s + self.settings.resting_s:
            return  # it is from before the robot came to rest, elsewhere
        robot.newest, robot.heard_s = message, now_s
        if abs(braking := _braking(message)) > _DRIVES_M:
            robot.heading_rad = cmath.phase(braking)
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
        """Make new cells; to be called once per period.

        Args:
            now_s: Hub's clock.

        Raises:
            SegmentsMeet: A robot is about to run into another or a wall: it has not kept to its cell.
        """
        self._look_for_silence(now_s)
        reported = {
            name: robot.newest
            for name, robot in self._robots.items()
            if now_s - robot.heard_s <= SILENT_S and robot.listened_to and self._is_kept_off(name)
        }
        made = self._new_cells(reported)
        names = list(self._robots)
        cells = [(made.get(name) or robot.adopted).cell for name, robot in self._robots.items()]
        targets = self._aiming.targets(names, self._states, cells)
        self._cells_made += 1
        for name, one in made.items():
            robot = self._robots[name]
            robot.using[self._cells_made] = one
            x, y = targets[name]
            robot.sent = Guidance(
                number=self._cells_made,
                target_x_m=x,
                target_y_m=y,
                half_planes=one.cell.binding(robot.segment).ravel(),
            )

    def guidance(self) -> dict[str, Guidance]:
        """Return the robots' guidance now, by name: repeated until there is something new."""
        echoes = {name: max(robot.echo_s, NOTHING_HEARD_S) for name, robot in self._robots.items()}
        return {name: robot.sent.model_copy(update={"echo_s": echoes[name]}) for name, robot in self._robots.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all robots of the team, sorted."""
        return tuple(self._robots)

    @property
    def places(self) -> Floats:
        """(n, 2) last reported places of the robots, in the order of their names (m, map frame)."""
        return np.array([robot.segment[:2] for robot in self._robots.values()]).reshape(-1, 2)

    @property
    def _states(self) -> Floats:
        """(n, 4) last reported x, y (m), heading (rad), speed (m/s) of the robots; the latter by the stopping point."""
        robots = self._robots.values()
        away_m = [abs(_braking(robot.newest)) for robot in robots]
        speeds_mps = [math.sqrt(2.0 * self.settings.deceleration_mps2 * each) for each in away_m]
        headings = [robot.heading_rad for robot in robots]
        return np.column_stack((self.places, headings, speeds_mps))

    @property
    def corners(self) -> dict[str, Floats]:
        """(c, 2) corners of the newest cell of each robot, by name (m, map frame)."""
        return {name: cell.corners for name, cell in self.cells.items()}

    @property
    def cells(self) -> dict[str, BufferedCell]:
        """Newest cell of each robot, by name."""
        return {name: robot.using[max(robot.using)].cell for name, robot in self._robots.items()}

    def decided(self, name: str) -> int:
        """Return the highest number of a cell that a robot has reported as adopted or refused."""
        return self._robots[name].newest.decided

    @property
    def outside_m(self) -> dict[str, float]:
        """Distance of each robot outside the cell that it keeps to, as reported; negative inside (m)."""
        return {name: robot.adopted.cell.excess_m(robot.segment) for name, robot in self._robots.items()}

    @property
    def nearest_m(self) -> float:
        """Smallest distance of two robots' stopping segments, as reported; inf for a single robot (m)."""
        return float(least_apart_m(np.array([robot.segment for robot in self._robots.values()]).reshape(-1, 4)))

    @property
    def goals(self) -> dict[str, tuple[float, float]]:
        """Goal of each robot at the last update, by the task (m, map frame)."""
        return self._aiming.goals

    @property
    def interventions(self) -> Interventions:
        """Changes of wished velocities by cells since the task began."""
        return self._aiming.interventions

    def _speed_towards(self, away_m: float) -> float:
        """Return the speed (m/s) at which a robot drives to a target so far away."""
        return min(math.sqrt(2.0 * self.settings.deceleration_mps2 * away_m), self.settings.speed_max_mps)

    @property
    def stuck(self) -> frozenset[str]:
        """Robots that the right-hand rule sends aside."""
        return self._aiming.stuck

    @property
    def resting(self) -> frozenset[str]:
        """Robots that have been silent for so long that they are only obstacles."""
        return frozenset(name for name, robot in self._robots.items() if robot.rests_within_m is not None)

    def taken_by(self, place: Floats) -> str:
        """Return a silent robot that may rest so near to a place (2,) (m) that nobody may go there; "": none."""
        point = complex(place[0], place[1])
        for name, robot in self._robots.items():
            for made in robot.using.values() if robot.rests_within_m is not None else ():
                there = np.ascontiguousarray(where_it_rests(made.cell, robot.segment, robot.rests_within_m or 0.0))
                if abs(nearest_in(there, len(there), point) - point) < 2.0 * self.settings.radius_m:
                    return name
        return ""

    def _is_kept_off(self, name: str) -> bool:
        """Return whether every cell in which another may drive keeps off a robot: not so while one has just joined."""
        since = self._robots[name].since  # earlier cells may keep off it where it was before it was carried off
        if since < FIRST_CELL:
            return True
        others = (robot for other, robot in self._robots.items() if other != name)
        return all(made.dead or number > since for robot in others for number, made in robot.using.items())

    def _look_for_silence(self, now_s: float) -> None:
        settings = self.settings
        for robot in self._robots.values():
            if robot.rests_within_m is None and now_s - robot.heard_s >= max(SILENT_S, settings.resting_s):
                braking_m = settings.speed_max_mps**2 / (2.0 * settings.deceleration_mps2)
                robot.rests_within_m = settings.speed_max_mps * settings.lease_s + braking_m
                for made in robot.using.values():
                    made.dead = True

    def _new_round(self, reported: Mapping[str, Whereabouts]) -> PlaneRound:
        """Return a new plane for every two of some robots.

        Raises:
            SegmentsMeet: Nothing keeps two of them apart.
        """
        self._planes_made += 1
        segments = {name: _segment(each) for name, each in reported.items()}
        return PlaneRound(self._planes_made, segments, self.settings.radius_m)

    def _new_cells(self, reported: Mapping[str, Whereabouts]) -> dict[str, MadeCell]:
        """Return a new cell for each of some robots.

        A robot that has adopted its last cell, and may be using no other, has a plane of the last round with all others
        of whom that is true. It is the newest that they share, so these need not be looked at pair by pair.

        Raises:
            SegmentsMeet: Nothing keeps two of them apart, or one from where another rests, or from a wall.
        """
        last, new = self._round, self._new_round(reported)
        mates = [name for name in reported if self._robots[name].uses_only(last)]
        rows = np.stack((last.among(mates), new.among(mates)), axis=2)
        places, known = {name: place for place, name in enumerate(mates)}, frozenset(mates)
        apart = [(bisect_left(mates, name), name) for name in self._robots if name not in known]
        made = {}
        for name, each in reported.items():
            if name in known:
                stops, near = sorted((*apart, (places[name], name))), rows[places[name]]
            else:
                stops, near = [(0, other) for other in self._robots if other != name], np.zeros((0, 2, 3))
            own = {other: self._planes_of(name, other, new) for _, other in stops if other != name}
            cell = self._cell(name, each, _in_order(name, near, own, stops))
            rounds = (last, new) if name in known else (new,)
            made[name] = MadeCell(name, cell, own, rounds, known if name in known else frozenset())
        self._round = new
        return made

    def _planes_of(self, name: str, other: str, new: PlaneRound) -> list[Plane]:
        """Return planes for a robot's new cell: one with each cell that another may be using, and the new one."""
        bonds = (self._bond(name, other, each) for each in self._robots[other].using.values())
        planes = {bond.number: bond for bond in bonds}
        if other in new.places:
            planes[new.number] = new.plane(name, other)
        return list(planes.values())

    def _bond(self, name: str, other: str, made: MadeCell) -> Plane:
        """Return the plane that keeps a robot off another that may be using this cell."""
        robot = self._robots[name]
        if made.dead:
            return self._beside(name, other, made)
        # Only a robot that comes back may have no plane in common with it, but was kept off by one of that cell's.
        if not robot.adopted.dead and (common := robot.adopted.shared(made)):
            return common
        return max(made.planes(name), key=lambda plane: plane.number)

    def _beside(self, name: str, other: str, made: MadeCell) -> Plane:
        """Return a new plane that keeps a robot off another that rests in a cell.

        Raises:
            SegmentsMeet: It has no normal: nothing keeps the two apart.
        """
        resting = self._robots[other]
        there = where_it_rests(made.cell, resting.segment, resting.rests_within_m or 0.0)
        x, y, mine, others = strip_off(self._robots[name].segment, there, 2.0 * self.settings.radius_m)
        if x == 0.0 and y == 0.0:
            raise SegmentsMeet(name, other)
        self._planes_made += 1
        return Plane(self._planes_made, {name: np.array((x, y, mine)), other: np.array((-x, -y, -others))})

    @property
    def _radii(self) -> tuple[float, float]:
        return self.settings.radius_m, self.settings.wall_radius_m

    def _cell(self, name: str, reported: Whereabouts, given: Floats) -> BufferedCell:
        """Make a cell of the half-planes (k, 3) that keep a robot off the others, and those of the area."""
        rows = np.zeros((1, len(given) + len(self._area.sides) + len(self._area.walls), 3))
        rows[0, : len(given)] = given
        (cell,) = within_area(_segment(reported)[None], self._area, self._radii, rows, [name])
        return cell


def _in_order(name: str, rows: Floats, own: Mapping[str, Sequence[Plane]], stops: Sequence[tuple[int, str]]) -> Floats:
    """Return (k, 3) the half-planes of a robot, by the names of those that they keep it off.

    Args:
        name: Name of the robot.
        rows: (m, 2, 3) those with its mates, itself included, by their names.
        own: Planes with all others.
        stops: Robots that are no mates, and the robot itself if it is one, in the order of names, each with the place
            among the mates before which it comes.
    """
    pieces: list[Floats] = []
    singly: list[Floats] = []
    at = 0
    for place, other in (*stops, (len(rows), name)):
        if place > at:
            pieces += [np.array(singly).reshape(-1, 3), rows[at:place].reshape(-1, 3)]
            singly = []
        at = place + 1 if other == name else place
        singly += [plane.sides[name] for plane in own.get(other, ())]
    pieces.append(np.array(singly).reshape(-1, 3))
    return np.concatenate(pieces)


def _segment(reported: Whereabouts) -> Floats:
    """Return (4,) S: x₁ y₁ x₂ y₂ (m)."""
    return np.array((reported.x_m, reported.y_m, reported.stop_x_m, reported.stop_y_m))


def _braking(reported: Whereabouts) -> complex:
    """Return the way to the stopping point (m)."""
    return complex(reported.stop_x_m - reported.x_m, reported.stop_y_m - reported.y_m)


def _stays(reported: Whereabouts, number: int) -> Guidance:
    """Return guidance to stay where it stands."""
    return Guidance(number=number, echo_s=reported.stamp_s, target_x_m=reported.x_m, target_y_m=reported.y_m)
