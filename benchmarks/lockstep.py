"""An external follower in a process of its own, asked over loopback in every tick: ticks a second.

`python -m benchmarks lockstep`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

from benchmarks._joints import field
from benchmarks._settings import Small
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.onboard.control import FollowerQuestion
from touchline.schemas import topics
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.lockstep import Lockstep

EXAMPLE = Path(__file__).parent.parent / "examples" / "external_follower.py"
START_S = 60.0
SMALL = Small(
    {},
    ("# questions: # a second, # ms in the median, p99 # ms", "#x real time, # not answered"),
)


class _Timed:
    """A lockstep that notes how long each answer took."""

    def __init__(self, ask: Lockstep) -> None:
        self._ask = ask
        self.took_s: list[float] = []

    def __call__(self, question: FollowerQuestion) -> tuple[float, float]:
        begun = time.perf_counter()
        wheels = self._ask(question)
        self.took_s.append(time.perf_counter() - begun)
        return wheels


def main() -> None:
    """Drive 35 m with the example controller and print how long the answers took."""
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    with Bus.open(topics.ROBOT_SIM, config) as bus:
        environment = {**os.environ, **config.environment(), "PYTHONPATH": os.pathsep.join(sys.path)}
        outside = subprocess.Popen([sys.executable, str(EXAMPLE)], env=environment)
        try:
            if bus.wait_for({"follower"}, START_S):
                sys.exit("the example controller did not come up")
            ask = _Timed(Lockstep(bus))
            emulator = Emulator(Vehicle(), Scenario(), OnboardConfig(follower="external"), ask=ask)
            emulator.load(field())
            emulator.start()
            begun = time.perf_counter()
            while emulator.active:
                emulator.tick()
                if emulator.onboard.state == TraversalStatus.PAUSED:  # it was not answered in time
                    with suppress(CommandRefused):  # as long as it brakes
                        emulator.resume()
            wall_s = time.perf_counter() - begun
        finally:
            outside.terminate()
            outside.wait()
    median, p99 = np.quantile(ask.took_s, (0.5, 0.99))
    rate = len(ask.took_s) / sum(ask.took_s)
    print(
        f"{len(ask.took_s)} questions: {rate:.0f} a second, {1e3 * median:.2f} ms in the median, p99 {1e3 * p99:.2f} ms"
    )
    print(f"{emulator.time_s / wall_s:.1f}x real time, {emulator.onboard.status.follower_fallbacks} not answered")
