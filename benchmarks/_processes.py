"""Process tree, memory, threads and descriptors of a system, from the operating system."""

from __future__ import annotations

import os
import resource
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

from touchline.schemas import topics
from touchline.schemas.roles import Role

NODES: Final = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
_NAMED: Final = (*NODES, topics.COORDINATOR, Role.ROUTER)
_PROC: Final = Path("/proc")
_PAGE_BYTES: Final = resource.getpagesize()


class Figures(NamedTuple):
    """Present resources of a process."""

    memory_mb: float
    threads: int
    descriptors: int


def figures(pid: int) -> Figures | None:
    """Read the resources of a process; `None` if it does not exist."""
    try:
        pages = int((_PROC / str(pid) / "statm").read_text().split()[1])
        threads = len(list((_PROC / str(pid) / "task").iterdir()))
        descriptors = len(list((_PROC / str(pid) / "fd").iterdir()))
    except OSError:
        return None
    return Figures(pages * _PAGE_BYTES / 1e6, threads, descriptors)


def cpu_s(pid: int) -> float:
    """Processor time of a process (s)."""
    fields = (_PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def waited_s(pid: int) -> float:
    """Time for which the first thread of a process has waited for a processor (s)."""
    return int((_PROC / str(pid) / "schedstat").read_text().split()[1]) / 1e9


def processes(supervisor: int) -> dict[str, int]:
    """Process ids of a supervisor and of what it runs, by name.

    A service has its node's name; what a service runs in turn has that and a number, as `robot-sim/1`.
    """
    below = _children()
    found = {topics.SUPERVISOR: supervisor}
    for child in below.get(supervisor, []):
        words = _command(child)
        name = next((word for word in words if word in _NAMED), None)
        if name is None:
            continue
        found[name] = child
        found |= {f"{name}/{number}": pid for number, pid in enumerate(sorted(_descendants(child, below)), start=1)}
    return found


def _descendants(pid: int, below: dict[int, list[int]]) -> list[int]:
    return [each for child in below.get(pid, []) for each in (child, *_descendants(child, below))]


def _children() -> dict[int, list[int]]:
    """Living processes by their parents."""
    below: dict[int, list[int]] = {}
    for folder in _PROC.iterdir():
        if folder.name.isdigit():
            with suppress(OSError, ValueError, IndexError):
                state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
                if state != "Z":
                    below.setdefault(int(parent), []).append(int(folder.name))
    return below


def _command(pid: int) -> list[str]:
    try:
        return (_PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return []


def limit_descriptors(pid: int, most: int) -> int:
    """Limit the descriptors of a process; return the previous limit."""
    soft, hard = resource.prlimit(pid, resource.RLIMIT_NOFILE)
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (most, hard))
    return soft
