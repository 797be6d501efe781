"""Robots that drive the same plan in step, for those who learn controllers: nominal ticks of all in one call."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.arrays import copy
from touchline.core.jit import kernel, unlocked
from touchline.core.kernel_batch import KernelBatch
from touchline.onboard import filter_model as model
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.robot_sim.fast_runner import ASKING, TickProgress, run_nominal_ticks
from touchline.services.robot_sim.stepped_drive import SteppedDrive
from touchline.services.robot_sim.world.body import BodyState

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Values = NDArray[np.float32]
Flags = NDArray[np.bool_]

# Values of a question; behind them reference speed and yaw rate in the rows of the path ahead.
V_LATERAL: Final = 0  # drive's origin to the robot's left of the path [m]
V_HEADING: Final = 1  # heading less that of the path [rad]
V_NOZZLE: Final = 2  # nozzle to the left of its own path [m]
V_SPEED: Final = 3  # m/s
V_YAW_RATE: Final = 4  # rad/s
V_REFERENCE: Final = 5  # reference speed [m/s]
V_AHEAD: Final = 6

# Outcome of a step.
O_REWARD: Final = 0
O_NOZZLE: Final = 1  # true distance of the nozzle to the left of its path at the last question [m]
O_HEADING: Final = 2  # true heading error then [rad]
OUTCOMES: Final = 3

NOZZLE_M: Final = 0.02
"""This error, and each of the next two, costs what a second of driving earns."""
HEADING_RAD: Final = 0.1
SPEED_MPS: Final = 0.2
LEAST_REWARD_PS: Final = -10.0


class Form(NamedTuple):
    """Form of the questions and answers of all robots.

    Attributes:
        rows: (k,) rows of the path ahead that are shown.
        lead: Row that answers are relative to.
        share: Share of its speed and yaw rate that is added to an answer: 0, or 1 for answers that correct the plan.
        truth: True to show true errors and motion instead of estimated ones.
        limit_m: True distance of the nozzle from its path beyond which nothing more is answered.
        bounds: (V_AHEAD + 2 k,) largest absolute values that are shown.
    """

    rows: Integers
    lead: int
    share: float
    truth: bool
    limit_m: float
    bounds: Floats


class Dialogue(NamedTuple):
    """Answer to a robot's questions, and what it shows then.

    Attributes:
        answer: (2 + actuators,) speed [m/s], yaw rate [rad/s], and commands of the actuators; nan if the drive is to
            work them out.
        left: (1,) number of questions that are still to be answered with it.
        stage: (1,) stage of the tick, as in `TickProgress`.
        noted: (1,) tick of the last question, whose values and outcome are filled in.
        values: (V_AHEAD + 2 k,) values of the last question.
        outcome: (OUTCOMES,) of the step so far.
        form: Form of them.
    """

    answer: Floats
    left: Integers
    stage: Integers
    noted: Integers
    values: Values
    outcome: Floats
    form: Form


@kernel
def note_question(states: Sequence[BodyState], computer: Computer, ahead: Floats, dialogue: Dialogue) -> None:
    """Fill in values and outcome of a question.

    Args:
        states: (1,) true state of the body.
        computer: (1,) computer that asks.
        ahead: (n, AHEAD_COLUMNS) path ahead.
        dialogue: Values, outcome and questions left are updated.
    """
    c, state, values, outcome, form = computer[0], states[0], dialogue.values, dialogue.outcome, dialogue.form
    leg, now = c.leg, c.leg.now
    dialogue.noted[0] = c.times.tick
    x = c.filter.states[c.times.tick % model.RING]
    true_rad, believed_rad = state.heading_rad, x[model.HEADING]
    east_m, north_m = state.east_m - x[model.EAST], state.north_m - x[model.NORTH]
    path_rad = believed_rad - now[tracking.HEADING_ERROR]
    cos, sin = math.cos(true_rad) - math.cos(believed_rad), math.sin(true_rad) - math.sin(believed_rad)
    nozzle_east_m = east_m + cos * leg.nozzle_x_m - sin * leg.nozzle_y_m
    nozzle_north_m = north_m + sin * leg.nozzle_x_m + cos * leg.nozzle_y_m
    left_east, left_north = -math.sin(path_rad), math.cos(path_rad)
    nozzle_m = now[tracking.NOZZLE_LATERAL] + left_east * nozzle_east_m + left_north * nozzle_north_m
    heading_rad = wrapped(true_rad - path_rad)
    late_mps = state.speed_mps - now[tracking.REFERENCE_SPEED]
    loss = (nozzle_m / NOZZLE_M) ** 2 + (heading_rad / HEADING_RAD) ** 2 + (late_mps / SPEED_MPS) ** 2
    outcome[O_REWARD] += TICK_S * max(1.0 - loss, LEAST_REWARD_PS)
    outcome[O_NOZZLE], outcome[O_HEADING] = nozzle_m, heading_rad
    if abs(nozzle_m) > form.limit_m:
        dialogue.left[0] = 0
    if form.truth:
        values[V_LATERAL] = now[tracking.LATERAL] + left_east * east_m + left_north * north_m
        values[V_HEADING], values[V_NOZZLE] = heading_rad, nozzle_m
        values[V_SPEED], values[V_YAW_RATE] = state.speed_mps, state.yaw_rate_radps
    else:
        values[V_LATERAL], values[V_HEADING] = now[tracking.LATERAL], now[tracking.HEADING_ERROR]
        values[V_NOZZLE] = now[tracking.NOZZLE_LATERAL]
        values[V_SPEED], values[V_YAW_RATE] = now[tracking.SPEED], now[tracking.YAW_RATE]
    values[V_REFERENCE] = now[tracking.REFERENCE_SPEED]
    for i in range(len(form.rows)):
        values[V_AHEAD + 2 * i] = ahead[form.rows[i], A_SPEED]
        values[V_AHEAD + 2 * i + 1] = ahead[form.rows[i], A_YAW_RATE]
    for i in range(len(values)):
        values[i] = min(max(values[i], -form.bounds[i]), form.bounds[i])


@unlocked
def answer_question(
    progress: Sequence[TickProgress],
    states: Sequence[BodyState],
    computer: Computer,
    ahead: Floats,
    twist: Floats,
    dialogue: Dialogue,
) -> bool:
    """Answer the question of a nominal tick, for `run_nominal_ticks` to go on.

    Args:
        progress: (1,) progress of the ticks.
        states: (1,) true state of the body.
        computer: (1,) computer that asks.
        ahead: (n, AHEAD_COLUMNS) path ahead.
        twist: (2 + actuators,) filled with the answer.
        dialogue: Answer; the rest is updated.

    Returns:
        False if nothing is asked, or no question is left to be answered.
    """
    at, left, form = progress[0], dialogue.left, dialogue.form
    dialogue.stage[0] = at.stage
    if at.stage != ASKING:
        return False
    if dialogue.noted[0] != at.tick:
        note_question(states, computer, ahead, dialogue)
    if left[0] <= 0:
        return False
    left[0] -= 1
    copy(dialogue.answer, twist)
    twist[0] += form.share * ahead[form.lead, A_SPEED]
    twist[1] += form.share * ahead[form.lead, A_YAW_RATE]
    return True


@kernel
def begin_step(ticks: int, over: Flags, left: Integers, outcomes: Floats) -> None:
    """Set the questions (n,) that are left of robots whose drive is not over, and clear the rewards (n, OUTCOMES)."""
    for i in range(len(left)):
        left[i] = 0 if over[i] else ticks
        outcomes[i, O_REWARD] = 0.0


@kernel
def first_unfinished(left: Integers, stages: Integers) -> int:
    """Return the first robot that has questions left or whose tick was not nominal; -1 if there is none."""
    for i in range(len(left)):
        if left[i] > 0 or stages[i] != ASKING:
            return i
    return -1


class SteppedRobots:
    """Robots that drive the same plan, each with noise of its own.

    Attributes:
        drives: Drive of each.
        answers: (n, 2 + actuators) to be set before `step`, as `Dialogue.answer`.
        values: (n, V_AHEAD + 2 k) values of each robot's last question.
        outcomes: (n, OUTCOMES) of the last step.
        over: (n,) True if a robot's drive is over, or the robot has paused.
    """

    def __init__(self, setup: Setup, job: tuple[Trajectory, Template], count: int, form: Form, threads: int) -> None:
        """Put robots at the start.

        Args:
            setup: The robot and its world.
            job: The plan, and the template to evaluate the work by.
            count: Number of robots.
            form: Form of questions and answers.
            threads: Number of threads that step them.

        Raises:
            CommandRefused: The robot does not take the plan.
        """
        rows = int(form.rows[-1]) + 1, form.lead + 1
        self.drives = [SteppedDrive(setup, *job, rows) for _ in range(count)]
        actuators = len(setup.vehicle.drive.actuators)
        self.answers: Floats = np.full((count, 2 + actuators), np.nan)
        self.values: Values = np.zeros((count, V_AHEAD + 2 * len(form.rows)), dtype=np.float32)
        self.outcomes: Floats = np.zeros((count, OUTCOMES))
        self.over: Flags = np.zeros(count, dtype=np.bool_)
        self._left, self._stages = np.zeros(count, dtype=np.int64), np.full(count, ASKING)
        single = (each[:, None] for each in (self._left, self._stages, np.zeros(count, dtype=np.int64)))
        parts = zip(self.answers, *single, self.values, self.outcomes, strict=True)
        self._dialogues = [Dialogue._make((*part, form)) for part in parts]
        self._batch = KernelBatch(answer_question, run_nominal_ticks, count)
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        bounds = np.linspace(0, count, threads + 1).astype(int).tolist()
        self._parts = list(pairwise(bounds))
        for i in range(count):
            self._take(i)

    def restart(self, i: int, seed: int) -> None:
        """Put a robot at the start again, just switched on, with a seed of all noise."""
        self.drives[i].restart(seed)
        self._take(i)

    def step(self, ticks: int) -> None:
        """Answer so many questions of each robot whose drive is not over, fewer if it ends."""
        begin_step(ticks, self.over, self._left, self.outcomes)
        if self._pool is None:
            self._batch.run(0, len(self.drives))
        else:
            list(self._pool.map(self._batch.run, *zip(*self._parts, strict=True)))
        while (i := first_unfinished(self._left, self._stages)) >= 0:
            self._go_on(i)

    def _go_on(self, i: int) -> None:
        """Answer the rest of a robot's questions, of which some come in ticks that are not nominal."""
        drive, form = self.drives[i], self._dialogues[i].form
        while self._left[i] > 0 or self._stages[i] != ASKING:
            if self._stages[i] != ASKING:
                self._stages[i] = ASKING
                drive.answered()
            elif drive.asked.arguments is not None:
                self._batch.run(i, i + 1)
                continue
            else:
                self._left[i] -= 1
                speed_mps, yaw_rate_radps, *actuators = self.answers[i].tolist()
                planned_mps, planned_radps = drive.asked.ahead[form.lead].tolist()
                twist = speed_mps + form.share * planned_mps, yaw_rate_radps + form.share * planned_radps
                drive.answer(BodyTwist(*twist, None if math.isnan(actuators[0]) else tuple(actuators)))
            self._take(i)

    def _take(self, i: int) -> None:
        """Take over a robot's next question, if there is one."""
        drive, asked = self.drives[i], self.drives[i].asked
        self.over[i] = drive.over or drive.emulator.onboard.state == TraversalStatus.PAUSED
        if self.over[i] or asked.arguments is None:
            self._batch.clear(i)
        else:
            progress, hardware, pilot, _ = asked.arguments
            question = progress, hardware.world.state, pilot.computer, asked.ahead, pilot.pursuit.twist
            self._batch.set(i, (*question, self._dialogues[i]), asked.arguments)
        if not drive.over:
            emulator = drive.emulator
            self._note(emulator.world.state.array, emulator.onboard.computer, asked.ahead, self._dialogues[i])
        if self.over[i]:
            self._left[i] = 0

    @cached_property
    def _note(self) -> Callable[..., None]:
        """The kernel `note_question`, without checking the types of its arguments, which are always the same."""
        emulator, ahead = self.drives[0].emulator, self.drives[0].asked.ahead
        arguments = emulator.world.state.array, emulator.onboard.computer, ahead, self._dialogues[0]
        code: Callable[..., None] = note_question.for_types_of(arguments)
        return code
