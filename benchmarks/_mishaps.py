"""Disturbances of a system during a stop: strangers on the bus, and services frozen, killed or restarting."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks._processes import NODES, limit_descriptors
from benchmarks._stranger_roles import SPEED_VARIABLE
from benchmarks._strangers import AT_ONCE, KINDS, stranger
from benchmarks._system import System
from touchline.schemas import topics
from touchline.schemas.roles import Role

NOTHING: Final = "none"
_SIGNALS: Final = {"freeze": signal.SIGSTOP, "kill": signal.SIGKILL, "restart": signal.SIGTERM}
_FEW_DESCRIPTORS: Final = 64
LOADS: Final = (
    NOTHING,
    *KINDS,
    *(f"{deed}-{node}" for deed in _SIGNALS for node in NODES),
    f"freeze-{topics.SUPERVISOR}",
)
SECURED_LOADS: Final = (*LOADS, *(f"{deed}-{Role.ROUTER}" for deed in _SIGNALS))
"""A secured system has a router, too."""


@dataclass
class Mishap:
    """Disturbance of a system.

    Attributes:
        load: Name, of `LOADS`.
        node: Service that is frozen, killed or restarted; empty for strangers.
        pid: Process id of the service.
        thaw_s: Time at which a frozen one is to continue (monotonic); infinite until that is known.
        thawed_s: Time at which it did.
    """

    load: str
    node: str = ""
    pid: int = 0
    thaw_s: float = float("inf")
    thawed_s: float | None = None

    @property
    def frozen(self) -> bool:
        """True if a service is frozen."""
        return self.load.startswith("freeze-") and self.thawed_s is None

    @property
    def ended(self) -> bool:
        """True if the service's process was ended by a signal."""
        return self.load.startswith(("kill-", "restart-"))

    def poll(self) -> None:
        """Continue a frozen service when it is time."""
        if self.frozen and time.monotonic() >= self.thaw_s:
            self.thaw()

    def thaw(self) -> None:
        """Continue a frozen service now."""
        if not self.frozen:
            return
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGCONT)
        self.thawed_s = time.monotonic()

    @property
    def gone(self) -> bool:
        """True if the service's process has ended."""
        try:
            return Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True


@contextmanager
def mishap(load: str, system: System, chance: random.Random, speed: float) -> Iterator[Mishap]:
    """Disturb `system` until the context is left; the disturbance has begun on entry."""
    with ExitStack() as stack:
        if load in KINDS:
            peers = chance.randint(1, AT_ONCE.get(load, 1))
            environment = {**system.environment, SPEED_VARIABLE: f"{speed:g}"}
            if load == "many-peers":
                stack.enter_context(_few_descriptors(system))
            stack.enter_context(stranger(load, environment, peers))
            yield Mishap(load)
            return
        if load == NOTHING:
            yield Mishap(load)
            return
        deed, _, node = load.partition("-")
        done = Mishap(load, node, system.processes().get(node, 0))
        if not done.pid:
            raise ProcessLookupError(f"{node} does not run: {system.last_words()}")
        os.kill(done.pid, _SIGNALS[deed])
        try:
            yield done
        finally:
            done.thaw()


@contextmanager
def _few_descriptors(system: System) -> Iterator[None]:
    """Limit the robot's open files as `ulimit -n 64` would."""
    pid = system.processes()[topics.ROBOT_SIM]
    before = limit_descriptors(pid, _FEW_DESCRIPTORS)
    try:
        yield
    finally:
        with suppress(ProcessLookupError):
            limit_descriptors(pid, before)
