"""Processor time of another process, and whether it waits for a processor; from Linux's /proc."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

#: States of threads that run or would, but for the machine: on or waiting for a processor, or for a disk.
_WANTS = ("R", "D")


class ProcessorUse(NamedTuple):
    """Processor time of a process since its start (s), and which of its threads wait for a processor.

    Attributes:
        loop_s: Time of its first thread, in which the loop of a service turns.
        all_s: Time of all its threads.
        loop_wants: Whether the first thread runs, or waits for a processor or a disk.
        others_want: Whether another one does.
    """

    loop_s: float
    all_s: float
    loop_wants: bool
    others_want: bool


def processor_use(pid: int) -> ProcessorUse | None:
    """Return the processor use of a process; None where that cannot be known.

    Args:
        pid: Process id.
    """
    try:
        all_s = time.clock_gettime(_cpu_clock(pid))
        loop_state, loop_s = _thread(Path(f"/proc/{pid}/task/{pid}"))
        others = [each for each in Path(f"/proc/{pid}/task").iterdir() if each.name != str(pid)]
    except OSError:
        return None
    return ProcessorUse(loop_s, all_s, loop_state in _WANTS, any(_state(each) in _WANTS for each in others))


def _cpu_clock(pid: int) -> int:
    """Return the id of a process's processor-time clock, as `clock_getcpuclockid` of Linux makes it."""
    return ~pid << 3 | 2


def _thread(folder: Path) -> tuple[str, float]:
    """Return state and processor time (s) of a thread: fields 3, 14 and 15 of proc(5)'s stat."""
    fields = (folder / "stat").read_text().rpartition(")")[2].split()
    return fields[0], (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _state(folder: Path) -> str:
    with suppress(OSError):  # it has ended meanwhile
        return _thread(folder)[0]
    return ""
