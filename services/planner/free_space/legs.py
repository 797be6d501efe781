"""Ways of straights and turns on the spot, and the body that drives them among walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.services.planner.free_space.body_sweeps import (
    drives_free,
    headings_free,
    legs_turns,
    off_walls,
    swept_free,
)
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.wall_grid import WallGrid
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose

# A stop costs as much as driving this far (m), so that of ways of about the same length the one with fewer is taken.
STOP_M = 0.02


@dataclass(frozen=True)
class Legs:
    """Way from pose to pose: turns on the spot and straights in turn, beginning and ending with a turn.

    Attributes:
        places: (n + 1, 3) x (m), y (m), and direction of the straight that ends there: 1.0 forward, −1.0 backward.
        turns_rad: (n + 1,) signed turn at each place.
        start: Pose where it begins.
    """

    places: Floats
    turns_rad: Floats
    start: PathPose

    @property
    def length_m(self) -> float:
        """Length of all straights."""
        return legs_length(self.places)

    @property
    def manoeuvres(self) -> int:
        """Number of straights."""
        return len(self.places) - 1


def _least_off(part: Floats) -> float:
    """Least distance of the origin inward from the edges of a convex part (n, 2), counter-clockwise."""
    along = np.roll(part, -1, axis=0) - part
    return float(((along[:, 1] * part[:, 0] - along[:, 0] * part[:, 1]) / np.hypot(*along.T)).min())


def legs_length(places: Floats) -> float:
    """Length of straights from place to place (m)."""
    return float(np.hypot(*np.diff(places[:, :2], axis=0).T).sum())


class WalledBody(NamedTuple):
    """A body, in convex parts, among walls; see `body_sweeps.swept_free`.

    Attributes:
        corners, sizes: Its convex parts.
        walls: Edges of the obstructed ground.
        ground: The ground.
        backs: True if it may drive backward.
    """

    corners: Floats
    sizes: Ints
    walls: WallGrid
    ground: ObstructedGround
    backs: bool = True

    @classmethod
    def of(cls, ground: ObstructedGround, parts: Sequence[Floats], *, backs: bool = True) -> WalledBody:
        """Body of these convex parts on a ground."""
        return cls(np.concatenate(parts), np.array([len(each) for each in parts]), ground.walls, ground, backs)

    @property
    def senses(self) -> tuple[float, ...]:
        """Directions in which it may drive: forward 1.0, backward −1.0."""
        return (1.0, -1.0) if self.backs else (1.0,)

    @property
    def reach_m(self) -> float:
        """Distance of the furthest corner from the body's origin."""
        return float(np.hypot(*self.corners.T).max())

    @property
    def disc_m(self) -> float:
        """Radius of the largest disc round the body's origin within one of its convex parts (m)."""
        parts = np.split(self.corners, np.cumsum(self.sizes)[:-1])
        return max(max(_least_off(part), 0.0) for part in parts)

    def stands_free(self, pose: PathPose) -> bool:
        """True if the body is on free ground at a pose."""
        inside = bool(shapely.contains_xy(self.ground.free, pose.x_m, pose.y_m))
        return inside and self.sweeps(np.array([pose]), 0.0)

    def sweeps(self, poses: Floats, slack_m: float) -> bool:
        """True if the body can move from pose to pose; see `body_sweeps.swept_free`."""
        return bool(swept_free(poses, self.corners, self.sizes, self.walls, slack_m))

    def drives(self, pairs: Floats) -> Ints:
        """Find free straights; see `body_sweeps.drives_free`."""
        return np.asarray(drives_free(np.ascontiguousarray(pairs), self.corners, self.sizes, self.walls))

    def turning(self, places: Floats, sectors: int) -> NDArray[np.bool_]:
        """Find free sectors of heading (n, sectors) at places (n, 2)."""
        return np.asarray(headings_free(places, self.corners, self.sizes, self.walls, sectors)) > 0.0

    def off_walls(self, places: Floats, most_m: float) -> Floats:
        """Find the distances (n,) of places (n, 2) from the walls; see `body_sweeps.off_walls`."""
        return np.asarray(off_walls(places, most_m, self.walls))

    def turns(self, places: Floats, entry_rad: float, exit_rad: float) -> Floats:
        """Find the turns of straights; see `body_sweeps.legs_turns`."""
        return np.asarray(legs_turns(places, entry_rad, exit_rad, self.corners, self.sizes, self.walls))

    def legs(self, places: Floats, start: PathPose, goal: PathPose) -> Legs | None:
        """Legs over places from a start to a goal; None if something is not free."""
        turns = self.turns(places, start.heading_rad, goal.heading_rad)
        return Legs(places, turns, start) if len(turns) else None
