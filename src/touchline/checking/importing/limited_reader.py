"""Reader of logs in a process of its own, with limits on time and memory."""

from __future__ import annotations

import os
import resource
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from touchline.recordings.logs.formats import LOG_FORMATS, read_logs
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream
from touchline.supervision.worker_process import WorkerLost, WorkerProcess

_LEAST_BYTES: Final = 1_500_000_000
_MEMORY_RATIO: Final = 30
_LEAST_S: Final = 60
_S_PER_MB: Final = 3
_REMEDY: Final = "; cut it into several, or export it anew: it may be damaged or made to be so"
Task = tuple[Sequence[Path], Collection[str] | None]


@dataclass(frozen=True)
class ReadingLimits:
    """Limits of the process that reads some logs, beside what it takes to start.

    Attributes:
        memory_bytes: Address space.
        processor_s: Processor time.
    """

    memory_bytes: int
    processor_s: int

    @classmethod
    def of(cls, paths: Sequence[Path]) -> ReadingLimits:
        """Create limits for files of this size; at most the machine's memory."""
        size = sum(_bytes_of(path) for path in paths)
        has = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        return cls(min(_LEAST_BYTES + _MEMORY_RATIO * size, has), _LEAST_S + _S_PER_MB * size // 1_000_000)


def read_limited(
    paths: Sequence[Path], streams: Collection[str] | None = None, limits: ReadingLimits | None = None
) -> tuple[list[LogStream], LogContent]:
    """Run `read_logs` in a process of its own.

    Args:
        paths: The files.
        streams: Names of streams to read; None: all.
        limits: Default: by the files' size.

    Raises:
        LogError: One of them cannot be read, or takes too much time or memory.
    """
    allowed = limits or ReadingLimits.of(paths)
    names = ", ".join(map(str, paths))
    worker = WorkerProcess()
    try:
        worker.begin(_read, allowed)
        worker.take()
        worker.give(0, (paths, streams))
        found: tuple[list[LogStream], LogContent] = worker.take()
    except MemoryError as error:
        raise LogError(f"{names}: reading it takes more than {allowed.memory_bytes / 1e9:.1f} GB{_REMEDY}") from error
    except WorkerLost as lost:
        what = f"more than {allowed.processor_s:,} s of processor time" if "SIGXCPU" in str(lost) else "too much"
        raise LogError(f"{names}: reading it takes {what}{_REMEDY}") from lost
    finally:
        worker.end()
    return found


def _read(limits: ReadingLimits, task: Task) -> tuple[list[LogStream], LogContent]:
    """Read in the child process."""
    for name in LOG_FORMATS.names():  # loading the readers does not count
        LOG_FORMATS.find(name)
    used_s = sum(os.times()[:2])
    _limit(resource.RLIMIT_AS, limits.memory_bytes + _address_space_bytes())
    _limit(resource.RLIMIT_CPU, limits.processor_s + round(used_s) + 1)
    paths, streams = task
    try:
        return read_logs(paths, streams)
    finally:
        _limit(resource.RLIMIT_AS, resource.RLIM_INFINITY)  # what was read is sent in copies


def _limit(what: int, most: int) -> None:
    _, hard = resource.getrlimit(what)
    within = most if hard == resource.RLIM_INFINITY else hard if most == resource.RLIM_INFINITY else min(most, hard)
    with suppress(ValueError, OSError):  # the system does not limit that
        resource.setrlimit(what, (within, hard))


def _address_space_bytes() -> int:
    """Return this process's address space, as far as the system reports it."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        return 0
    return pages * resource.getpagesize()


def _bytes_of(path: Path) -> int:
    """Return the size of a file, or of all in a folder; 0 if it is not there, which reading it reports."""
    try:
        files = [each for each in path.iterdir() if each.is_file()] if path.is_dir() else [path]
        return sum(each.stat().st_size for each in files)
    except (OSError, ValueError):
        return 0
