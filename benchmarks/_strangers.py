"""Misbehaving peers, each a separate process: slow readers, floods, impostors.

Like strangers on the same machine, they use raw Zenoh and raw sockets, not Touchline's bus.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parent.parent
_READY_S: Final = 240.0
"""The largest payloads take seconds to make."""


@dataclass(frozen=True)
class Kind:
    """Kind of misbehaviour.

    Attributes:
        role: Role, of `_stranger_roles.ROLES`.
        most: Maximum number of such peers at once.
        stopped: Whether the process is stopped (SIGSTOP) once it has joined.
    """

    role: str
    most: int = 1
    stopped: bool = False


KINDS: Final[Mapping[str, Kind]] = {
    "slow-reader": Kind("slow-reader"),
    "stopped-reader": Kind("slow-reader", stopped=True),
    "flood-paint": Kind("flood-paint", most=3),
    "flood-load": Kind("flood-load", most=3),
    "flood-load-9.7MB": Kind("flood-load-9.7MB", most=2),
    "flood-load-keys": Kind("flood-load-keys"),
    "flood-diagnostics": Kind("flood-diagnostics", most=3),
    "flood-speed": Kind("flood-speed", most=3),
    "flood-estop": Kind("flood-estop", most=3),
    "flood-junk": Kind("flood-junk", most=3),
    "idle-connections": Kind("idle-connections"),
    "many-peers": Kind("many-peers"),
    "rogue-tokens": Kind("rogue-tokens"),
    "rogue-answers": Kind("rogue-answers"),
    "rogue-wildcards": Kind("rogue-wildcards"),
    "rogue-numbers": Kind("rogue-numbers"),
    "rogue-diagnostics": Kind("rogue-diagnostics"),
}


@contextmanager
def stranger(kind: str, environment: Mapping[str, str], peers: int = 1) -> Iterator[list[int]]:
    """Run misbehaving peers until the context is left; yields their process ids once all have begun.

    Args:
        kind: Kind, of `KINDS`.
        environment: Bus configuration from `BusConfig.environment`.
        peers: Number of peers.
    """
    chosen = KINDS[kind]
    with ExitStack() as stack:
        processes = [stack.enter_context(_process(chosen.role, environment)) for _ in range(peers)]
        for process in processes:
            _await_word(process, kind)
            if chosen.stopped:
                os.kill(process.pid, signal.SIGSTOP)
        yield [process.pid for process in processes]


@contextmanager
def _process(role: str, environment: Mapping[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "benchmarks._stranger_roles", role],
        cwd=ROOT,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _await_word(process: subprocess.Popen[bytes], kind: str) -> None:
    """Wait until the stranger reports that it has begun."""
    assert process.stdout is not None
    begun = time.monotonic()
    if not select.select([process.stdout], [], [], _READY_S)[0] or not process.stdout.readline():
        raise RuntimeError(f"{kind} has not begun after {time.monotonic() - begun:.0f} s, exit code {process.poll()}")
