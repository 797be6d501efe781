"""Accuracy of the nozzle on the lines of a soccer pitch, by noise and follower, pooled over seeds.

`python -m benchmarks accuracy`; `runs` is the number of seeds of the noisy cases.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from benchmarks._data_sheets import data_sheets
from benchmarks._settings import Small
from touchline.onboard import control
from touchline.onboard.control.follower import BodyTwist
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import Trajectory
from touchline.schemas.onboard import Follower, OnboardConfig
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator

VEHICLE = Vehicle()
FOLLOWERS: tuple[Follower, ...] = ("mpc", "pure-pursuit")
LONG_BURSTS = GnssNoise(burst_s=10.0, burst_tau_s=3.0)
SMALL = Small(
    {"runs": 1, "template": "study-square"},
    (
        *(
            f"{follower}, {noise} # seeds: mean # p95 # max # mm; against the estimate p95 # mm; worst p95 # mm"
            for follower in FOLLOWERS
            for noise in ("no noise", "white tail", "default noise", "bursts of 10 s")
        ),
        "follower's tick p99 # ms, fallbacks #",
    ),
)


class Timed:
    """A follower with a stopwatch."""

    def __init__(self, inner: control.Follower) -> None:
        self.inner = inner
        self.times_s: list[float] = []

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        begun = time.perf_counter()
        command = self.inner.step(now, ahead)
        self.times_s.append(time.perf_counter() - begun)
        return command


def drive(
    trajectory: Trajectory, template: Template, scenario: Scenario, config: OnboardConfig
) -> tuple[Emulator, list[float], Timed]:
    """Run a session; return also the nozzle's estimated distances from its line, and the follower's times."""
    emulator = Emulator(VEHICLE, scenario, config)
    onboard = emulator.onboard
    timed = Timed(onboard._traversal._follower)
    onboard._traversal._follower = timed  # type: ignore[assignment]
    emulator.load(trajectory, template)
    emulator.start()
    followed = []
    while emulator.active:
        emulator.tick()
        if emulator.command.valve:
            followed.append(abs(onboard.lateral_error_m))
    return emulator, followed, timed


def _case(name: str, follower: Follower, trajectory: Trajectory, template: Template, scenarios: list[Scenario]) -> None:
    errors, followed, times, fallbacks, worst = [], [], [], 0, (0.0, 0)
    for scenario in scenarios:
        emulator, estimated, timed = drive(trajectory, template, scenario, data_sheets(scenario, follower=follower))
        lateral = np.abs(emulator.work.ledger.deviation().lateral_m)
        errors.append(lateral)
        followed += estimated
        times += timed.times_s
        fallbacks += emulator.onboard.status.follower_fallbacks
        worst = max(worst, (float(np.percentile(lateral, 95)), scenario.seed))
    pooled, title = np.concatenate(errors) * 1e3, f"{follower}, {name}"
    print(
        f"{title:32s} {len(scenarios):3d} seeds: mean {pooled.mean():5.2f}  p95 {np.percentile(pooled, 95):5.2f}  "
        f"max {pooled.max():5.2f} mm; against the estimate p95 {np.percentile(followed, 95) * 1e3:.2f} mm; "
        f"worst p95 {worst[0] * 1e3:.1f} mm (seed {worst[1]})"
    )
    print(f"{'':32s} follower's tick p99 {np.percentile(times, 99) * 1e3:.2f} ms, fallbacks {fallbacks}")


def main(runs: int = 20, template: str = "soccer-11") -> None:
    """Run all cases, and print their figures."""
    seeds = range(1, runs + 1)
    lines = load_template(template)
    trajectory = plan(lines, VEHICLE).trajectory
    for follower in FOLLOWERS:
        quiet = [Scenario(noise="none")]
        _case("no noise", follower, trajectory, lines, quiet)
        for name, gnss in (
            ("white tail", GnssNoise.white_tail()),
            ("default noise", GnssNoise()),
            ("bursts of 10 s", LONG_BURSTS),
        ):
            scenarios = [Scenario(seed=seed, gnss=gnss) for seed in seeds]
            _case(name, follower, trajectory, lines, scenarios)
