"""Interface of team algorithms: what they may know, and what they may wish.

An algorithm only wishes. What keeps robots apart, the team's `avoid`, changes wishes as far as it must. Either one
object decides for all (`TeamAlgorithm`), or each robot has an object of its own, which knows of others what they send
by radio and nothing else (`RobotAlgorithm`). Both are made anew for each run, with the options of the team's file as
keyword arguments. All places are in the map frame.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, Self

from touchline.coordination.free_area import FreeArea

MOST_BYTES: Final = 1024
"""Longest message of a robot's algorithm."""


@dataclass(frozen=True)
class VelocityWish:
    """Wish to drive at a velocity (m/s, map frame)."""

    x_mps: float
    y_mps: float

    @classmethod
    def of(cls, velocity: complex, most_mps: float) -> Self:
        """Return the wish for a velocity x + iy (m/s), made shorter if it is longer than a largest speed."""
        velocity *= min(1.0, most_mps / max(abs(velocity), most_mps))
        return cls(velocity.real, velocity.imag)


@dataclass(frozen=True)
class TwistWish:
    """Wish to drive at a speed forward (m/s) and a yaw rate (rad/s, counter-clockwise)."""

    speed_mps: float
    yaw_rate_radps: float


@dataclass(frozen=True)
class GoalWish:
    """Wish to be at a place (m); the way there is not the algorithm's."""

    x_m: float
    y_m: float


@dataclass(frozen=True)
class PathWish:
    """Wish to drive along straight lines through places (m) to the last of them."""

    points_m: Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Hold:
    """Wish to stay."""


HOLD: Final = Hold()
Wish = VelocityWish | TwistWish | GoalWish | PathWish | Hold


@dataclass(frozen=True)
class Me:
    """Knowledge of a robot at an update: its own state, and what all robots were given before the start.

    Attributes:
        name: Its name.
        team: Names of all robots, sorted.
        now_s: Time since the team began.
        period_s: Time from one update to the next.
        x_m: Place, as it estimates it.
        y_m: Likewise.
        heading_rad: Its heading, counter-clockwise from x; with cells the direction in which it last drove, 0 before.
        vx_mps: Its velocity.
        vy_mps: Likewise.
        goal_m: Goal that the task gives it, if it gives any.
        importance: Density φ of the task where it is: 1 if the task has none.
        speed_max_mps: Largest speed.
        radius_m: Radius r_s that it keeps free.
        range_m: Range of its radio.
        area: The area, with walls.
        seed: Seed of the run, for random choices that are to be repeatable.
    """

    name: str
    team: tuple[str, ...]
    now_s: float
    period_s: float
    x_m: float
    y_m: float
    heading_rad: float
    vx_mps: float
    vy_mps: float
    goal_m: tuple[float, float] | None
    importance: float
    speed_max_mps: float
    radius_m: float
    range_m: float
    area: FreeArea
    seed: int


@dataclass(frozen=True)
class Team:
    """Knowledge of a central algorithm at an update.

    Attributes:
        now_s: Time since the team began.
        robots: What each robot knows, by name.
        importance: Density φ of the task at a place (x, y in m).
    """

    now_s: float
    robots: Mapping[str, Me]
    importance: Callable[[float, float], float]


class TeamAlgorithm(Protocol):
    """Central algorithm: decides for all robots."""

    def decide(self, now: Team, /) -> Mapping[str, Wish]:
        """Return the wish of each robot by its name; called once per update. One without a wish holds."""
        ...


class RobotAlgorithm(Protocol):
    """Distributed algorithm: one object per robot."""

    def start(self, me: Me, /) -> None:
        """Begin; called once, before all else."""
        ...

    def heard(self, sender: str, payload: bytes, age_s: float, /) -> None:
        """Take a message of another robot, which may be late, or be overtaken by a later one.

        Args:
            sender: Name of the robot that sent it.
            payload: What it sent.
            age_s: Time since then.
        """
        ...

    def decide(self, me: Me, /) -> tuple[Wish, bytes | None]:
        """Return a wish, and at most 1,024 bytes for all robots within range; called once per update."""
        ...
