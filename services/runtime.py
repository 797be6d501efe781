"""The system that ``touchline up`` runs: one per bus endpoint, found again by ``touchline down``."""

import fcntl
import os
import re
import signal
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from schemas.errors import TouchlineError
from services.bus import BusConfig


def state_folder() -> Path:
    """Where lock files and logs are: ``$XDG_RUNTIME_DIR/touchline``, or one per user under the temporary folder."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "touchline" if base else Path(tempfile.gettempdir()) / f"touchline-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def _lock_path(config: BusConfig) -> Path:
    return state_folder() / (re.sub(r"\W+", "-", f"{config.endpoint}-{config.namespace}") + ".pid")


@contextmanager
def only_one(config: BusConfig) -> Iterator[None]:
    """Be the one system on this bus; the lock goes with the process, however it ends.

    Raises:
        TouchlineError: Another one runs.
    """
    path = _lock_path(config)
    with path.open("a+") as lock:
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
    """Process id of the system on this bus, if one runs."""
    path = _lock_path(config)
    if not path.exists():
        return None
    with path.open() as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            text = lock.read().strip()
            return int(text) if text.isdigit() else None
    return None


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
