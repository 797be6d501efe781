"""Starts the service processes, watches them, restarts what died, and stops them all.

Children are executed afresh, never forked: a forked Zenoh session hangs. Each gets a process group of its own, so that
Ctrl-C reaches the supervisor alone and it can end things in order; each ends by itself when its supervisor is gone.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from services.bus import BusConfig
from services.bus.presence import Presence

#: A restart waits this long, doubled for each failure in a row.
_FIRST_BACKOFF_S = 0.1
_LONGEST_BACKOFF_S = 5.0
#: A process that ran this long has recovered.
_HEALTHY_S = 10.0
#: A process whose liveliness token is gone this long, though it still runs, hangs.
_HUNG_S = 5.0
_STOP_S = 5.0


class Notice(NamedTuple):
    """Something that happened to a service: ``kind`` is ``started``, ``died``, ``hung`` or ``restarted``."""

    node: str
    kind: str
    text: str


@dataclass
class Child:
    """One supervised service.

    Attributes:
        node: Its name on the bus.
        arguments: ``touchline`` arguments that run it.
    """

    node: str
    arguments: Sequence[str]
    process: subprocess.Popen[bytes] | None = None
    started_at: float = 0.0
    failures: int = 0
    restart_at: float | None = None
    seen: bool = False
    missing_since: float | None = None


class Supervisor:
    """Keeps a set of services running; call :meth:`poll` often."""

    def __init__(self, children: Sequence[Child], config: BusConfig, log_folder: Path) -> None:
        """Nothing is started yet.

        Args:
            children: The services.
            config: The bus that they shall join.
            log_folder: Where each writes its output, as ``<node>.log``.
        """
        self.children = list(children)
        self._config = config
        self._log_folder = log_folder
        log_folder.mkdir(parents=True, exist_ok=True)

    def start(self) -> None:
        """Start every service."""
        for child in self.children:
            self._spawn(child)

    def poll(self, presence: Presence | None = None) -> list[Notice]:
        """Restart what died or hangs; says what happened.

        Args:
            presence: The bus's liveliness, already polled; without it only exit codes are watched.
        """
        notices: list[Notice] = []
        now = time.monotonic()
        for child in self.children:
            if child.process is None:
                if child.restart_at is not None and now >= child.restart_at:
                    self._spawn(child)
                    notices.append(
                        Notice(child.node, "restarted", f"{child.node} restarted (pid {self.pid(child.node)})")
                    )
            elif (code := child.process.poll()) is not None:
                notices.append(Notice(child.node, "died", f"{child.node} {_how_it_ended(code)}"))
                self._schedule_restart(child, now)
            elif presence is not None and self._hangs(child, presence, now):
                child.process.kill()
                notices.append(Notice(child.node, "hung", f"{child.node} left the bus but still ran; killed"))
        return notices

    def pid(self, node: str) -> int | None:
        """Process id of ``node``, if it runs."""
        return next((c.process.pid for c in self.children if c.node == node and c.process is not None), None)

    def log_tail(self, node: str, lines: int = 15) -> str:
        """The end of what ``node`` wrote."""
        path = self._log_path(node)
        text = path.read_text(errors="replace") if path.exists() else ""
        return "\n".join(text.splitlines()[-lines:])

    def stop(self) -> None:
        """Ask every service to end, and end those that do not."""
        running = [child.process for child in self.children if child.process is not None]
        for process in running:
            process.terminate()
        deadline = time.monotonic() + _STOP_S
        for process in running:
            try:
                process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for child in self.children:
            child.process = child.restart_at = None

    def _log_path(self, node: str) -> Path:
        return self._log_folder / f"{node}.log"

    def _spawn(self, child: Child) -> None:
        with self._log_path(child.node).open("ab") as log:
            child.process = subprocess.Popen(
                [sys.executable, "-m", "services.cli", *child.arguments, "--supervisor", str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **self._config.environment(), "PYTHONUNBUFFERED": "1"},
                process_group=0,
            )
        child.started_at = time.monotonic()
        child.restart_at = child.missing_since = None
        child.seen = False

    def _schedule_restart(self, child: Child, now: float) -> None:
        child.failures = 0 if now - child.started_at > _HEALTHY_S else child.failures + 1
        backoff = min(_FIRST_BACKOFF_S * 2 ** max(0, child.failures - 1), _LONGEST_BACKOFF_S)
        child.process, child.restart_at = None, now + backoff

    @staticmethod
    def _hangs(child: Child, presence: Presence, now: float) -> bool:
        if child.node in presence.alive():
            child.seen, child.missing_since = True, None
        elif child.seen and child.missing_since is None:
            child.missing_since = now
        return child.missing_since is not None and now - child.missing_since > _HUNG_S


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
