"""Processor time of another process, and whether it waits for a processor; from Linux's /proc."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

#: States of threads that run or would, but for the machine: on or waiting for a processor, or for a disk.
_WANTS = ("R", "D")


class ProcessorUse(NamedTuple):
    """What a process is doing.

    Attributes:
        used_s: Processor time of all its threads since its start, s.
        wants: Whether one of them runs, or waits for a processor or a disk.
    """

    used_s: float
    wants: bool


def processor_use(pid: int) -> ProcessorUse | None:
    """What a process is doing; None where that cannot be known.

    Args:
        pid: Process id.
    """
    try:
        used_s = time.clock_gettime(_cpu_clock(pid))
        threads = list(Path(f"/proc/{pid}/task").iterdir())
    except OSError:
        return None
    return ProcessorUse(used_s, any(_state(thread) in _WANTS for thread in threads))


def _cpu_clock(pid: int) -> int:
    """Id of the clock that counts the processor time of a process, as `clock_getcpuclockid` of Linux makes it."""
    return ~pid << 3 | 2


def _state(thread: Path) -> str:
    with suppress(OSError):  # it has ended meanwhile
        return (thread / "stat").read_text().rpartition(")")[2].split()[0]
    return ""
