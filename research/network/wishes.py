"""Algorithms that are compared with ours: straight to the goal, and ORCA's own library."""

import cmath
from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any, Final

from touchline.team_algorithms import Me, Team, VelocityWish, Wish

INSTALL: Final = "pyrvo is not installed, its rows are left out: pip install './research[peers]'."
THERE_M: Final = 0.05
FAR_M: Final = 1.0
_SLOWS_1PS: Final = 1.5
_NEIGHBOURS: Final = 10


def has_pyrvo() -> bool:
    """True if ORCA's library is installed."""
    return find_spec("pyrvo") is not None


def straight(me: Me, right_rad: float = 0.0) -> complex:
    """Velocity (m/s) to the goal, turned right by an angle while that is far; 0 once there."""
    here = complex(me.x_m, me.y_m)
    way = (here if me.goal_m is None else complex(*me.goal_m)) - here
    if abs(way) < THERE_M:
        return 0j
    turn = cmath.rect(1.0, -right_rad) if abs(way) > FAR_M else 1.0
    wish: complex = way / abs(way) * turn * min(me.speed_max_mps, _SLOWS_1PS * abs(way))
    return wish


class Straight:
    """Every robot straight to its goal, whoever is in the way."""

    def decide(self, now: Team) -> Mapping[str, Wish]:
        """Return wishes, as of `TeamAlgorithm`."""
        return {name: VelocityWish.of(straight(me), me.speed_max_mps) for name, me in now.robots.items()}


class OrcaLibrary:
    """Velocities of ORCA's own library, RVO2, for all robots, which it knows at once and exactly.

    As in `examples/teams/orca.py`: horizon 3 s, radius grown by 0.1 m for what unicycles cannot follow, wishes turned
    right by 0.3 rad.
    """

    def __init__(self, horizon_s: float = 3.0, more_m: float = 0.1, right_rad: float = 0.3) -> None:
        self._horizon_s, self._more_m, self._right_rad = horizon_s, more_m, right_rad
        self._simulator: Any = None

    def decide(self, now: Team) -> Mapping[str, Wish]:
        """Return wishes, as of `TeamAlgorithm`."""
        robots = list(now.robots.values())
        if self._simulator is None:
            self._simulator = self._begun(robots)
        simulator = self._simulator
        for number, me in enumerate(robots):
            wish = straight(me, self._right_rad)
            simulator.set_agent_position(number, (me.x_m, me.y_m))
            simulator.set_agent_velocity(number, (me.vx_mps, me.vy_mps))
            simulator.set_agent_pref_velocity(number, (wish.real, wish.imag))
        simulator.do_step()
        found = [simulator.get_agent_velocity(number) for number in range(len(robots))]
        return {me.name: VelocityWish(wish.x, wish.y) for me, wish in zip(robots, found, strict=True)}

    def _begun(self, robots: list[Me]) -> Any:
        import pyrvo

        me, reach_m = robots[0], 2.0 * self._horizon_s * robots[0].speed_max_mps
        radius_m = me.radius_m + self._more_m
        given = (me.period_s, reach_m, _NEIGHBOURS, self._horizon_s, self._horizon_s, radius_m, me.speed_max_mps)
        simulator = pyrvo.RVOSimulator(*given)
        for each in robots:
            simulator.add_agent((each.x_m, each.y_m))
        return simulator
