"""Interruptions of a painting robot, and the joints of its lines on the ground."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks._drive_to import step_towards
from benchmarks._invariants import fault
from touchline.onboard.interface import Checkpoint
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Actuation, Trajectory, TraversalStatus
from touchline.schemas.onboard import Follower, OnboardConfig
from touchline.schemas.scenario import Noise, Scenario
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.projection import project

PAUSED, DONE, ESTOPPED = TraversalStatus.PAUSED, TraversalStatus.DONE, TraversalStatus.ESTOPPED
RUN_IN_M: Final = 6.0
PIECES: Final = ((0.0, RUN_IN_M, False), (0.0, 10.0, True), (0.2, 9.0, True), (0.0, 8.0, True), (0.0, 2.0, False))
"""Curvature [1/m] and length [m] of the axle's path, and whether it is sprayed."""
ENDS_M: Final = tuple(itertools.accumulate(length for _, length, _ in PIECES))
PATIENCE_TICKS: Final = 300
"""After which the operator resets and resumes."""
FAULT_S: Final = 4.0
BEGINS_TICK: Final = 60_000
"""The robot has been at work for ten minutes, and the satellites' error has wandered."""
LIMIT_TICKS: Final = 20000


class Joint(NamedTuple):
    """Gap or doubled paint where one stroke ends and the next begins [m]; one of them is 0."""

    gap_m: float
    double_m: float


def field(speed_mps: float = 1.0) -> Trajectory:
    """A line of 10 m, an arc of 9 m to the left and a line of 8 m, in one go, with run-in and run-out."""
    x = y = heading = at = 0.0
    segments, switches = [], []
    for i, (curvature, length, sprayed) in enumerate(PIECES):
        curve = Curve(x, y, heading, curvature, length)
        segments.append(segment(f"s{i}", curve))
        switches.append((at, Actuation.DISC_SPRAY if sprayed else Actuation.NONE))
        (x, y, heading), at = curve.end, at + length
    ramp = 0.5 * speed_mps**2
    speeds = ((0.0, 0.0), (ramp, speed_mps), (at - ramp, speed_mps), (at, 0.0))
    return assemble(segments, switches, (velocity(s, v) for s, v in speeds))


def joints(*ledgers: PaintLedger) -> list[Joint]:
    """Every place along the lines of the first ledger where a full stroke ends and another goes on, true paint.

    Ledgers are of the same lines, which continue one another; paint of all of them counts. Exact to the millisecond of
    the valve.
    """
    return joints_along([target.curve for target in ledgers[0].targets], full_strokes(*ledgers))


def full_strokes(*ledgers: PaintLedger) -> list[NDArray[np.float64]]:
    """Points (n, 2) of each stroke of full width, true paint."""
    return [
        stroke.points
        for ledger in ledgers
        for stroke in ledger.strokes()
        if stroke.width_m > 0.99 * ledger.spray_width_m
    ]


def joints_along(curves: Sequence[Curve], strokes: Iterable[NDArray[np.float64]]) -> list[Joint]:
    """Every place along curves that continue one another where one of these strokes ends and another goes on."""
    spans = sorted(sorted((_station(points[0], curves), _station(points[-1], curves))) for points in strokes)
    ends = itertools.accumulate((end for _, end in spans), max)
    return [
        Joint(max(begin - end, 0.0), max(min(end, stroke_end) - begin, 0.0))
        for end, (begin, stroke_end) in zip(ends, spans[1:], strict=False)
    ]


def _station(point: NDArray[np.float64], curves: Sequence[Curve]) -> float:
    """Arc length along the concatenated curves of the point nearest to a point [m]."""
    best, nearest, begin = 0.0, math.inf, 0.0
    for curve in curves:
        row = np.array((curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m))
        along, lateral = project(float(point[0]), float(point[1]), row)
        beyond = max(-along, along - curve.length_m, 0.0)
        distance = math.hypot(lateral, beyond)
        if distance < nearest:
            nearest, best = distance, begin + along
        begin += curve.length_m
    return best


def _faulty(kind: str, **fields: object) -> Callable[[Emulator], None]:
    return lambda emulator: emulator.inject_fault(fault(kind, duration_s=FAULT_S, **fields))


def _paused_and_jolted(emulator: Emulator) -> None:
    """Something knocks against the robot once it stands."""
    emulator.pause()
    emulator.inject_fault(fault("imu-bias", start_s=2.0, duration_s=0.05, accel_mps2=10.0, gyro_radps=0.0))


CAUSES: Final[dict[str, Callable[[Emulator], None] | None]] = {
    "RTK outage": _faulty("gnss-outage"),
    "RTK float": _faulty("gnss-degraded", fix="float"),
    "pause": Emulator.pause,
    "pause, jolted": _paused_and_jolted,
    "e-stop, reset": Emulator.estop,
    "bumper": _faulty("bumper"),
    "operator lost": _faulty("operator-lost"),
    "empty tank": _faulty("tank-empty"),
    "clogged nozzle": _faulty("nozzle-clogged", share=0.3),
    "half-clogged nozzle": _faulty("nozzle-clogged", share=0.6),
    "valve stuck closed": _faulty("valve-stuck", position="closed"),
    "process killed": None,
}
"""Interruption of the robot; None: another process goes on from its checkpoint."""


def places(seed: int) -> list[float]:
    """Arc lengths [m] of the interruptions of a run: one on each line and one on the arc, clear of their ends."""
    draw = random.Random(seed)
    lines = [(ENDS_M[i - 1] + 1.5, ENDS_M[i] - 1.5) for i, (_, _, sprayed) in enumerate(PIECES) if sprayed]
    return [draw.uniform(*line) for line in lines]


def interrupted(
    cause: str,
    seed: int,
    noise: Noise = "default",
    follower: Follower = "mpc",
    begins_tick: int = BEGINS_TICK,
) -> list[PaintLedger]:
    """Paint the field, interrupted once on every line; the ledgers of all processes that took part.

    The robot begins in `begins_tick`, and has stood until then.

    Raises:
        AssertionError: The robot did not get to the end.
    """
    vehicle, plan, interrupt = Vehicle(), field(), CAUSES[cause]
    scenario, config = Scenario(seed=seed, noise=noise), OnboardConfig(follower=follower)
    emulator = Emulator(vehicle, scenario, config)
    emulator.load(plan, resume=Checkpoint(0, 0.0, None, begins_tick))
    emulator.start()
    ledgers, ahead, waiting = [emulator.work.ledger], [*places(seed), ENDS_M[-1]], 0
    runner = FastRunner(emulator)
    while emulator.tick_count < begins_tick + LIMIT_TICKS:
        step_towards(runner, emulator, ahead[0])
        status = emulator.onboard.status
        if len(ahead) > 1 and status.arc_length_m >= ahead[0]:
            del ahead[0]
            if interrupt is not None:
                interrupt(emulator)
                continue
            checkpoint = emulator.onboard.checkpoint
            emulator = Emulator(vehicle, scenario, config)
            emulator.load(plan, resume=checkpoint)
            emulator.start()
            runner = FastRunner(emulator)
            ledgers.append(emulator.work.ledger)
        waiting = waiting + 1 if status.state in (PAUSED, ESTOPPED) else 0
        if waiting and waiting % PATIENCE_TICKS == 0:
            with suppress(CommandRefused):
                emulator.reset() if status.state == ESTOPPED else emulator.resume()
        if status.state == DONE and not emulator.active:
            return ledgers
    raise AssertionError(f"{cause}, seed {seed}: still {emulator.onboard.status}")
