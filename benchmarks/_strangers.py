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
from pathlib import Path
from typing import Final

from benchmarks._stranger_roles import ROLES

ROOT: Final = Path(__file__).resolve().parent.parent
_READY_S: Final = 240.0
"""The largest payloads take seconds to make."""


STOPPED_READER: Final = "stopped-reader"
"""A slow reader whose process is stopped (SIGSTOP) once it has joined."""
KINDS: Final = (*ROLES, STOPPED_READER)
AT_ONCE: Final = {
    **dict.fromkeys(("flood-paint", "flood-load", "flood-diagnostics", "flood-speed", "flood-estop", "flood-junk"), 3),
    "flood-load-9.7MB": 2,
}
"""Maximum number of peers of a kind at once, if more than one."""


@contextmanager
def stranger(kind: str, environment: Mapping[str, str], peers: int = 1) -> Iterator[list[int]]:
    """Run misbehaving peers until the context is left; yields their process ids once all have begun.

    Args:
        kind: Kind, of `KINDS`.
        environment: Bus configuration from `BusConfig.environment`.
        peers: Number of peers.
    """
    role = "slow-reader" if kind == STOPPED_READER else kind
    with ExitStack() as stack:
        processes = [stack.enter_context(_process(role, environment)) for _ in range(peers)]
        for process in processes:
            _await_word(process, kind)
            if kind == STOPPED_READER:
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
