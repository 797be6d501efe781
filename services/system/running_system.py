"""The system that ``touchline up`` runs: one per bus endpoint, found again by ``touchline down``."""

import fcntl
import os
import re
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from touchline.schemas.errors import TouchlineError
from touchline.services.bus import BusConfig
from touchline.services.system.private_folder import open_private, run_folder


def _lock_path(config: BusConfig) -> Path:
    return run_folder() / (re.sub(r"\W+", "-", f"{config.endpoint}-{config.namespace}") + ".pid")


@contextmanager
def only_one(config: BusConfig) -> Iterator[None]:
    """Be the one system on this bus; the lock goes with the process, however it ends.

    Raises:
        TouchlineError: Another one runs, or the run folder is not private.
    """
    with os.fdopen(open_private(_lock_path(config), os.O_RDWR), "r+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise TouchlineError(
                f"a system is already running on {config.endpoint} (pid {running_pid(config)}); "
                "`touchline down` stops it, `touchline status` shows it"
            ) from error
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
        try:
            yield
        finally:
            lock.truncate(0)


def running_pid(config: BusConfig) -> int | None:
    """Process id of the system on this bus, if one runs.

    Raises:
        TouchlineError: The lock is held, but not by the process that the file names.
    """
    path = _lock_path(config)
    if not path.exists():
        return None
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
    """Whether the process is this user's and has this file open; where /proc cannot tell, that it is there will do."""
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


def stop_running(config: BusConfig, timeout_s: float) -> int | None:
    """Ask the system on this bus to stop, and wait until it has.

    Returns:
        Its process id, or ``None`` when there was none.

    Raises:
        TouchlineError: It is still there after ``timeout_s``.
    """
    pid = running_pid(config)
    if pid is None:
        return None
    os.kill(pid, signal.SIGTERM)
    deadline = time.monotonic() + timeout_s
    while running_pid(config) == pid:
        if time.monotonic() > deadline:
            raise TouchlineError(f"the system (pid {pid}) has not stopped within {timeout_s:.0f} s")
        time.sleep(0.05)
    return pid
