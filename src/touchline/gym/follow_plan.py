"""Environment of one robot that follows a plan."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from touchline.gym.follow_task import Actions, FollowTask, Observations, Work
from touchline.onboard.interface import TICKS_PER_S


class FollowPlan(gymnasium.Env[Observations, Actions]):
    """Robot that follows a plan by actions; see docs/guides/gym.md for actions, observations and rewards."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - the base's

    def __init__(
        self, plan: Work = "tennis", *, render_mode: Literal["rgb_array"] | None = None, **options: Any
    ) -> None:
        """Put a robot at the start of a plan.

        Args:
            plan: The plan; or a template, its name or its file, which is planned for the line marker first.
            render_mode: "rgb_array" for `render`.
            **options: Fields of `FollowPlanOptions`.

        Raises:
            SpecError: An argument cannot be used.
            PlanningError: The template cannot be driven.
        """
        self._task = FollowTask(plan, options, 1)
        self.action_space, self.observation_space = self._task.action_space, self._task.observation_space
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": TICKS_PER_S / self._task.options.ticks}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Put the robot at the start again, with a seed of its noise that is drawn.

        Args:
            seed: Seed from which those of this and of later episodes are drawn; None: go on drawing.
            options: None are known.
        """
        super().reset(seed=seed)
        drawn = self._task.restart(0, self.np_random)
        return self._task.observations[0], {"seed": drawn, **self._info()}

    def step(self, action: Actions) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Drive on by an action.

        Raises:
            SpecError: The action is of another shape, or not finite.
        """
        task = self._task
        task.step(np.asarray(action)[None])
        terminated, truncated = task.ends[:, 0].tolist()
        info = {**self._info(), **(task.ending(0) if terminated or truncated else {})}
        return task.observations[0], float(task.rewards[0]), terminated, truncated, info

    def _info(self) -> dict[str, Any]:
        emulator = self._task.robots.drives[0].emulator
        state = emulator.world.state
        truth = np.array((state.east_m, state.north_m, state.heading_rad, state.speed_mps, state.yaw_rate_radps))
        codes = tuple(event.code for event in emulator.take_events())
        return {"lateral_m": float(self._task.lateral_m[0]), "truth": truth, "events": codes}

    def render(self) -> NDArray[np.uint8] | None:
        """Picture of the plan and the robot, (height, width, 3), if the render mode is "rgb_array"."""
        if self.render_mode is None:
            return None
        canvas, robot = self._picture
        truth = self._task.robots.drives[0].emulator.world.pose
        robot.set_offsets([(truth.east_m, truth.north_m)])
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()

    @cached_property
    def _picture(self) -> tuple[Any, Any]:
        """Canvas with the plan, and the mark of the robot."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        axes = self._task.plan.plot()
        robot = axes.scatter([0.0], [0.0], s=40.0, color="black", zorder=10.0)
        figure = axes.get_figure(root=True)
        assert figure is not None, "axes have a figure"
        return FigureCanvasAgg(figure), robot
