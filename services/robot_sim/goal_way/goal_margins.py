"""Margins of ways to a goal: how near to things protection lets a robot come, and what a plan keeps from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.protection.way import OFF_AGAIN_M
from touchline.schemas.known_ground import KnownGround
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.goal_way.kept_things import KeptThings, PlannedThings, moved_off, places_on
from touchline.services.robot_sim.goal_way.seen_ground import SeenGround
from touchline.services.robot_sim.goal_way.way_ahead import WayAhead
from touchline.services.robot_sim.goal_way.way_request import SeenPlaces
from touchline.services.robot_sim.way_round.rest_request import coming_m, passing_m

Floats = NDArray[np.float64]

WIDER_M: Final = (0.15, 0.05, 0.02)
"""Distances beyond what protection needs that ways keep from things: what there is room for, the last at least."""
ERROR_M: Final = 0.12
"""Largest error of hits that is planned for: a robot that has just set off may not know its heading well yet."""
STANDS_ON_M: Final = 0.01
NEARER_M: Final = 0.01
"""Distance by which a robot that stands near to something may come nearer."""
NEAR_M: Final = 0.15
"""Distance from where it stands, beyond the body's length, within which it may be as near as that: all of the body has
to go by what is beside its front."""
OFF_WAY_M: Final = 0.02
OFF_WAY_RAD: Final = 0.03
"""Allowance for the robot's distance from its way and for its heading, which protection adds to what is needed, and for
the spacing of the poses that it looks at."""


class GoalMargins:
    """Distances from things, by the errors that the robot's hits have at present.

    A distance from things that may move is less what is kept from them beyond that from things that stand.

    Args:
        emulator: The robot.
        seen: Ground that is known, and what the robot has seen of it.

    Attributes:
        body: (k, 2) outline of the body in its own frame, m.
    """

    def __init__(self, emulator: Emulator, seen: SeenGround) -> None:
        self._emulator, self._seen = emulator, seen
        self._known = KeptThings(places_on(seen.known.obstacles))
        vehicle = emulator.vehicle
        self.body: Floats = np.array(vehicle.body.footprint_m)
        braking_mps2 = emulator.onboard.protection.braking_mps2
        self._margin_m = vehicle.protection.margin_m
        self._passing_m = passing_m(vehicle, braking_mps2)
        self._coming_m = coming_m(vehicle, braking_mps2, 0.0)
        self._off_way_m = OFF_WAY_M + OFF_WAY_RAD * float(np.hypot(*self.body.T).max())

    @property
    def seen_things(self) -> tuple[KeptThings, KeptThings]:
        """Seen things: those that stand, as a known outline explains them, and those that may move."""
        standing_m, moving_m = self._seen.places_m
        return KeptThings(standing_m), KeptThings(moving_m, self.farther_m)

    @property
    def things(self) -> tuple[KeptThings, ...]:
        """All things, by kinds."""
        return self._known, *self.seen_things

    def clearance_m(self, way: WayAhead, most_m: float) -> float:
        """Return the least distance from all things along a way, as of `KeptThings`."""
        return self.clearances_m((way,), most_m)[0]

    def clearances_m(self, ways: Sequence[WayAhead], most_m: float) -> list[float]:
        """Return the same of several ways."""
        things = self.things
        return [min(each.clearance_m(way, self.body, most_m) for each in things) for way in ways]

    @property
    def levels_m(self) -> tuple[float, ...]:
        """Margins to plan with, the widest first."""
        needed_m = self.needed_m
        wide_m = max(self._passing_m - self.farther_m, needed_m + WIDER_M[0])
        return (wide_m, *(needed_m + wider_m for wider_m in WIDER_M[1:]))

    def levels_from_m(self, begins: WayAhead) -> tuple[float, ...]:
        """Margins to plan a way with: also as near as the robot may come where it begins, if that is farther."""
        nearest_m = min(self._nearest_m(begins, each) for each in self.things)
        return tuple(sorted({*self.levels_m, max(nearest_m, self.levels_m[-1])}, reverse=True))

    @property
    def needed_m(self) -> float:
        """Distance from things that stand at which protection lets the robot pass, however slowly."""
        return self._needed_with_m(min(self._emulator.onboard.protection.error_m, ERROR_M))

    @property
    def needed_now_m(self) -> float:
        """The same where the robot begins a way, by the error that hits have now."""
        return self._needed_with_m(self._emulator.onboard.protection.error_m)

    def _needed_with_m(self, error_m: float) -> float:
        return self._margin_m + error_m + self._off_way_m

    @property
    def farther_m(self) -> float:
        """Distance that it needs from things that may move beyond that from those that stand.

        It is that at which it comes to rest: from there on it may come no nearer.
        """
        if not self._coming_m:
            return 0.0
        return self._coming_m + min(self._emulator.onboard.protection.error_m, ERROR_M) + OFF_AGAIN_M

    def passes(self, way: WayAhead, begins: WayAhead) -> bool:
        """Return whether protection lets the robot drive a way: it comes no nearer to things than it may, or is."""
        needed_m, needed_now_m = self.needed_m, self.needed_now_m
        last = begins.poses[-1]
        near = np.hypot(*(way.poses[:, :2] - last[:2]).T) < NEAR_M + float(np.ptp(self.body[:, 0]))
        near |= way.station_m < begins.station_m[-1] - begins.station_m[0]
        first, rest = way.where(near), way.where(~near)
        return all(
            each.clearance_m(first, self.body, needed_now_m) >= self._nearest_m(begins, each)
            and each.clearance_m(rest, self.body, needed_m) >= needed_m
            for each in self.things
        )

    def planned(self, known: KnownGround, begins: WayAhead, margin_m: float) -> SeenPlaces:
        """Return all things for a plan with a margin: those nearer to where the way begins are moved off.

        Args:
            known: The known ground, with a boundary.
            begins: Begin of the way.
            margin_m: The margin.
        """
        beside, *things = (self._planned_things(each, begins, margin_m) for each in self.things)
        return SeenPlaces(known, beside.of_clear(self._known), tuple(things))

    def _planned_things(self, things: KeptThings, begins: WayAhead, margin_m: float) -> PlannedThings:
        clear = begins.swept(self.body, margin_m + things.farther_m + STANDS_ON_M)
        by_m = margin_m - self._nearest_m(begins, things)
        return PlannedThings(things._replace(places_m=moved_off(things.places_m, clear, by_m)), clear)

    def _nearest_m(self, begins: WayAhead, things: KeptThings) -> float:
        """Return the distance from things down to which protection lets the robot come near to where a way begins."""
        now_m = things.clearance_m(begins, self.body, self.needed_now_m)
        return max(now_m, -things.farther_m) - NEARER_M
