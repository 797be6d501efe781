"""Environment of many robots that follow the same plan, stepped in one call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from touchline.gym.follow_task import Actions, FollowTask, Observations, Work
from touchline.onboard.interface import TICKS_PER_S

Flags = NDArray[np.bool_]
Stepped = tuple[Observations, NDArray[np.float64], Flags, Flags, dict[str, Any]]


class FollowPlanVector(VectorEnv[Observations, Actions, NDArray[Any]]):
    """Robots that follow the same plan by actions, each as in `FollowPlan`.

    An episode that has ended begins anew in the next step, whose action is ignored and whose reward is 0.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - the base's

    def __init__(self, num_envs: int = 1, plan: Work = "tennis", *, threads: int = 1, **options: Any) -> None:
        """Put robots at the start of a plan.

        Args:
            num_envs: Number of robots.
            plan: The plan; or a template, its name or its file, which is planned for the line marker first.
            threads: Number of threads that step them.
            **options: Fields of `FollowPlanOptions`.

        Raises:
            SpecError: An argument cannot be used.
            PlanningError: The template cannot be driven.
        """
        self._task = FollowTask(plan, options, num_envs, threads)
        self.num_envs = num_envs
        self.single_action_space, self.single_observation_space = (
            self._task.action_space,
            self._task.observation_space,
        )
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.metadata = {**self.metadata, "render_fps": TICKS_PER_S / self._task.options.ticks}
        self._random = [seeding.np_random()[0] for _ in range(num_envs)]
        self._ended = np.ones(num_envs, dtype=np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Put all robots at the start again, with seeds of their noise that are drawn.

        Args:
            seed: Seed of each robot from which those of this and of later episodes are drawn, or that of the first one,
                the others being counted up from it; None: go on drawing.
            options: None are known.
        """
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        for i, given in enumerate(seeds or ()):
            if given is not None:
                self._random[i], _ = seeding.np_random(given)
        self._ended[:] = False
        drawn = [self._task.restart(i, random) for i, random in enumerate(self._random)]
        info = self._info(np.ones(self.num_envs, dtype=np.bool_))
        return self._task.observations, info | {"seed": np.array(drawn), "_seed": info["_lateral_m"]}

    def step(self, actions: Actions) -> Stepped:
        """Drive on by actions (n, k).

        Raises:
            SpecError: They are of another shape, or not finite.
        """
        task, again = self._task, self._ended
        task.robots.over |= again
        task.step(actions)
        infos: dict[str, Any] = {}
        for i in np.flatnonzero(again).tolist():
            infos = self._add_info(infos, {"seed": task.restart(i, self._random[i])}, i)
        rewards = task.rewards
        rewards[again] = 0.0
        terminated, truncated = task.ends & ~again
        self._ended = terminated | truncated
        for i in np.flatnonzero(self._ended).tolist():
            infos = self._add_info(infos, task.ending(i), i)
        return task.observations, rewards, terminated, truncated, infos | self._info(~again)

    def _info(self, there: Flags) -> dict[str, Any]:
        return {"lateral_m": self._task.lateral_m, "_lateral_m": there}
