"""Task of following a plan: options, spaces, and robots whose actions and observations are arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from pydantic import Field

from touchline.api.given_arguments import checked, setup_of
from touchline.api.plan_options import Positive
from touchline.api.planned import Plan, plan
from touchline.core.jit import kernel
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.trajectory.path_projection import COARSE_TICKS
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import MAX_SEED, Scenario
from touchline.schemas.spec import Spec
from touchline.schemas.template import Template
from touchline.services.robot_sim import stepped_robots as robots
from touchline.services.robot_sim.stepped_robots import Form, SteppedRobots

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Observations = NDArray[np.float32]
Actions = NDArray[np.float32]
Work = Plan | Template | str | Path | Mapping[str, Any]

TWIST_SHARE: Final = 1.5
"""Largest action "twist", as a multiple of the largest planned speed and yaw rate."""
RESIDUAL_SHARE: Final = 0.3
"""Largest action "residual", likewise."""
LEAST_YAW_RATE_RADPS: Final = 1.0
"""Yaw rate that the above are multiples of on a plan that hardly turns."""
LATERAL_LIMITS: Final = 2.0
"""Bound of observed distances, as a multiple of the limit at which an episode ends."""


@kernel
def scale_actions(actions: Floats, scale: Floats, answers: Floats, first: int) -> bool:
    """Scale actions, clipped to −1 … 1; return False as soon as one is not finite.

    Args:
        actions: (n, k).
        scale: (k,) factors.
        answers: (n, `first` + k or more) filled in from column `first` on.
        first: That column.
    """
    for i in range(len(actions)):
        for j in range(len(scale)):
            if not math.isfinite(actions[i, j]):
                return False
            answers[i, first + j] = min(max(actions[i, j], -1.0), 1.0) * scale[j]
    return True


@kernel
def find_ends(outcomes: Floats, limit_m: float, over: Flags, answered: Integers, most: int, ends: Flags) -> None:
    """Find robots whose episode has ended.

    Args:
        outcomes: (n, robots.OUTCOMES) of the last step.
        limit_m: Largest distance of a nozzle from its path.
        over: (n,) True where the drive is over.
        answered: (n,) ticks so far.
        most: Ticks after which an episode is truncated.
        ends: (2, n) filled with True where it is terminated and truncated.
    """
    for i in range(len(over)):
        ends[0, i] = over[i] or abs(outcomes[i, robots.O_NOZZLE]) > limit_m
        ends[1, i] = answered[i] >= most and not ends[0, i]


class FollowPlanOptions(Spec):
    """Options of the environments."""

    scenario: Scenario | None = None
    """World of the robot; None: undisturbed, on the ground that the vehicle is for."""
    ticks: Annotated[int, Field(ge=1, le=TICKS_PER_S)] = 5
    """Ticks of 10 ms for which an action holds."""
    action: Literal["twist", "residual", "actuators"] = "twist"
    """Meaning of an action: speed and yaw rate; their difference from the plan's; or commands of the actuators."""
    observation: Literal["estimate", "truth"] = "estimate"
    """Source of observed errors and motion: the robot's estimator, or the emulator."""
    limit_m: Positive = 0.5
    """True distance of the tool from its path at which an episode ends."""
    max_time_s: Positive = 600.0
    """Driving time after which an episode is truncated."""


class FollowTask:
    """Robots that drive a plan by actions.

    Attributes:
        plan: The plan.
        options: The options.
        robots: The robots.
        action_space: Box of an action.
        observation_space: Box of an observation.
    """

    def __init__(self, work: Work, options: Mapping[str, Any], count: int, threads: int = 1) -> None:
        """Put robots at the start of a plan.

        Args:
            work: The plan; or a template, its name or its file.
            options: Fields of `FollowPlanOptions`.
            count: Number of robots.
            threads: Number of threads that step them.

        Raises:
            SpecError: An argument cannot be used.
            PlanningError: The template cannot be driven.
        """
        for name, value in (("num_envs", count), ("threads", threads)):
            if value < 1:
                raise SpecError("touchline.gym", name, f"is {value}", "give 1 or more")
        self.options = given = checked(FollowPlanOptions, options, "touchline.gym")
        self.plan = work if isinstance(work, Plan) else plan(work)
        vehicle = self.plan.vehicle
        setup = setup_of(vehicle, given.scenario, None, None, None).at(self.plan.template.origin)
        lead = lead_ticks(drive_of(vehicle).lag_s)
        # Now, at the lead, and from there to a second ahead, every second one of the rows that are COARSE_TICKS apart.
        rows = np.array([0, lead, *range(lead + 2, lead + 1 + (TICKS_PER_S - lead) // COARSE_TICKS, 2)])
        path = self.plan.path()
        largest = np.array([np.abs(path["speed_mps"]).max(), LEAST_YAW_RATE_RADPS])
        largest[1] = max(largest[1], np.abs(path["speed_mps"] * path["curvature_1pm"]).max())
        high = self._bounds(len(rows), 2.0 * TWIST_SHARE * largest)
        residual, truth = float(given.action == "residual"), given.observation == "truth"
        form = Form(rows, lead, residual, truth, given.limit_m, high.astype(np.float64))
        self.robots = SteppedRobots(setup, (self.plan.trajectory, self.plan.template), count, form, threads)
        self._scale: Floats = (RESIDUAL_SHARE if given.action == "residual" else TWIST_SHARE) * largest
        if given.action == "actuators":
            self._scale = np.array([actuator.limit for actuator in vehicle.drive.actuators])
        self.robots.answers[:, :2] = 0.0
        self._first = 2 if given.action == "actuators" else 0
        self.observation_space = Box(-high, high, dtype=np.float32)
        self.action_space = Box(-1.0, 1.0, (len(self._scale),), np.float32)
        self._answered, self._most_ticks = np.zeros(count, dtype=np.int64), math.ceil(given.max_time_s * TICKS_PER_S)
        self._actions_shape = (count, len(self._scale))

    def _bounds(self, rows: int, twist: Floats) -> Observations:
        """Largest absolute values of an observation; `twist` is the largest speed and yaw rate."""
        high = np.zeros(robots.V_AHEAD + 2 * rows, dtype=np.float32)
        high[[robots.V_LATERAL, robots.V_NOZZLE]] = LATERAL_LIMITS * self.options.limit_m
        high[robots.V_HEADING] = np.pi
        high[[robots.V_SPEED, robots.V_REFERENCE]], high[robots.V_YAW_RATE] = twist[0], twist[1]
        high[robots.V_AHEAD :: 2], high[robots.V_AHEAD + 1 :: 2] = twist
        return high

    def restart(self, i: int, random: np.random.Generator) -> int:
        """Put a robot at the start again with a seed that is drawn; return the seed."""
        seed = int(random.integers(MAX_SEED, endpoint=True))
        self.robots.restart(i, seed)
        self._answered[i] = 0
        return seed

    def step(self, actions: Actions) -> None:
        """Step all robots whose drive is not over.

        Args:
            actions: (n, k) within the action space; clipped to it.

        Raises:
            SpecError: The actions are of another shape, or not finite.
        """
        given = np.ascontiguousarray(actions, dtype=np.float64)
        if given.shape != self._actions_shape:
            shape = self._actions_shape if self._actions_shape[0] > 1 else self._actions_shape[1:]
            raise SpecError("touchline.gym", "action", f"has {given.size} values", f"give an array of shape {shape}")
        if not scale_actions(given, self._scale, self.robots.answers, self._first):
            raise SpecError("touchline.gym", "action", "is not finite", "give numbers between -1 and 1")
        self.robots.step(self.options.ticks)
        self._answered += self.options.ticks

    @property
    def observations(self) -> Observations:
        """Observations (n, m), a new array."""
        return self.robots.values.copy()

    @property
    def rewards(self) -> Floats:
        """Rewards (n,) of the last step, a new array."""
        return self.robots.outcomes[:, robots.O_REWARD].copy()

    @property
    def lateral_m(self) -> Floats:
        """True distances (n,) of the tools to the left of their paths, a new array."""
        return self.robots.outcomes[:, robots.O_NOZZLE].copy()

    @property
    def ends(self) -> Flags:
        """Robots whose episode is terminated, and truncated, a new array (2, n).

        It is terminated where the drive is over, the robot has paused, or it is beyond the limit.
        """
        ends = np.empty((2, len(self._answered)), dtype=np.bool_)
        find_ends(self.robots.outcomes, self.options.limit_m, self.robots.over, self._answered, self._most_ticks, ends)
        return ends

    def ending(self, i: int) -> dict[str, Any]:
        """Information on a robot whose episode has ended: why, and the figures of its work if it is at the end."""
        drive = self.robots.drives[i]
        status = drive.emulator.onboard.status
        return {"reason": drive.stopped or status.reason, "coverage_pct": drive.emulator.onboard.painted.coverage_pct}
