"""Locks of running systems: at most one per robot and bus, by which ``touchline down`` finds them."""

import fcntl
import os
import re
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from touchline.bus import BusConfig
from touchline.schemas.errors import TouchlineError
from touchline.supervision.private_folder import open_private, run_folder


def _lock_path(config: BusConfig) -> Path:
    return run_folder() / f"{_bus_name(config)}-{_file_name(config.namespace)}.pid"


def _bus_name(config: BusConfig) -> str:
    """Return the name of an address, at which there is room for one bus, an open or a secured one."""
    return _file_name(config.endpoint.partition("/")[2])


def _file_name(text: str) -> str:
    return re.sub(r"\W+", "-", text)


@contextmanager
def only_one(config: BusConfig) -> Iterator[None]:
    """Lock these robots on this bus for this process; the locks vanish with it, however it ends.

    Raises:
        TouchlineError: Another one runs, or the run folder is not private.
    """
    with ExitStack() as locks:
        for namespace in config.namespaces:
            locks.enter_context(_locked(config.of(namespace)))
        yield


@contextmanager
def _locked(config: BusConfig) -> Iterator[None]:
    with os.fdopen(open_private(_lock_path(config), os.O_RDWR), "r+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise TouchlineError(
                f"a system is already running on {config.endpoint} with robot {config.namespace} "
                f"(pid {running_pid(config)}); `touchline down` stops it, `touchline status` shows it"
            ) from error
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
        try:
            yield
        finally:
            lock.truncate(0)


def running_pid(config: BusConfig) -> int | None:
    """Return the process id of this robot's system, if one runs.

    Raises:
        TouchlineError: The lock is held, but not by the process that the file names.
    """
    path = _lock_path(config)
    return holder_of(path) if path.exists() else None


def running_pids(config: BusConfig, robots: Sequence[str]) -> list[int]:
    """Return process ids of these robots' systems or, if none is named, of all that run on this bus; sorted.

    Raises:
        TouchlineError: A lock is held, but not by the process that the file names.
    """
    if robots:
        pids = [running_pid(config.of(robot)) for robot in robots]
    else:
        pids = [holder_of(path) for path in run_folder().glob(f"{_bus_name(config)}-*.pid")]
    return sorted({pid for pid in pids if pid is not None})


def holder_of(path: Path) -> int | None:
    """Return the process id that holds a lock file; None if nobody does.

    Raises:
        TouchlineError: It is locked, but does not name the process that holds it.
    """
    with os.fdopen(open_private(path, os.O_RDWR), "r") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            text = lock.read(32).strip()
            if not text:
                return None  # it begins or ends this moment
            if not text.isdigit() or not _has_open(int(text), lock.fileno()):
                raise TouchlineError(
                    f"{path} is locked, but does not name the process that holds it; remove it"
                ) from None
            return int(text)
    return None


def _has_open(pid: int, file: int) -> bool:
    """Return whether the process is this user's and has this file open; without /proc, whether it exists."""
    if pid <= 1:
        return False
    try:
        os.kill(pid, 0)
        ours = os.fstat(file)
        descriptors = Path("/proc") / str(pid) / "fd"
        if not Path("/proc/self/fd").is_dir():
            return True
        for descriptor in descriptors.iterdir():
            with suppress(OSError):  # closed meanwhile
                if os.path.samestat(descriptor.stat(), ours):
                    return True
    except OSError:
        pass
    return False


def stop_running(config: BusConfig, timeout_s: float, robots: Sequence[str] = ()) -> list[int]:
    """Ask the systems of these robots, or all on this bus if none is named, to stop, and wait until they have.

    Returns:
        Their process ids.

    Raises:
        TouchlineError: One still runs after ``timeout_s``.
    """
    pids = running_pids(config, robots)
    for pid in pids:
        os.kill(pid, signal.SIGTERM)
    deadline = time.monotonic() + timeout_s
    while left := set(pids) & set(running_pids(config, robots)):
        if time.monotonic() > deadline:
            raise TouchlineError(f"the system (pid {min(left)}) has not stopped within {timeout_s:.0f} s")
        time.sleep(0.05)
    return pids
