"""Supervisor of the service processes: starts them, watches them, restarts what died, and stops them all.

Children are executed afresh, never forked: a forked Zenoh session hangs. Each gets its own process group, so that
Ctrl-C reaches the supervisor alone and it can end things in order; each ends by itself when its supervisor is gone.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from touchline.bus import BusConfig
from touchline.bus.presence import Presence
from touchline.schemas.plain_text import plain
from touchline.security.identity import Identity
from touchline.supervision.heartbeat import HANGS_S, VARIABLE, HeartbeatWatch
from touchline.supervision.private_folder import open_private
from touchline.supervision.processor_use import processor_use
from touchline.supervision.safe_path import safe_path
from touchline.supervision.service_log import log_path

#: Delay of a restart, doubled for each failure in a row.
_FIRST_BACKOFF_S = 0.1
_LONGEST_BACKOFF_S = 5.0
#: Run time after which a process has recovered.
_HEALTHY_S = 10.0
#: Time in which all others are linked to a router that has begun.
_LINKED_S = 2.0
#: Time without liveliness token after which a process, though its loop turns, can be reached by nobody.
_UNREACHABLE_S = 5.0
#: Longest time to the first beat: a first start compiles the kernels, for minutes on a small computer.
_FIRST_BEAT_S = 600.0
_STOP_S = 5.0
_TAIL_LINES = 15
#: Bytes at the end of the output that are searched for the last words of a process.
_LAST_WORDS_BYTES = 4096
#: Size at which the output of a process begins anew, so that one that prints in every tick fills no disk.
_OUTPUT_BYTES = 10_000_000


class Notice(NamedTuple):
    """Event of a service.

    ``kind`` is ``hangs`` (its loop does not turn), ``turns`` (it does again), ``hung`` (it was killed), ``died`` or
    ``restarted``.
    """

    node: str
    kind: str
    text: str
    robots: tuple[str, ...] = ()
    """Namespaces of the robots concerned; empty: all."""


@dataclass
class Child:
    """One supervised service.

    Attributes:
        node: Its name on the bus.
        arguments: ``touchline`` arguments that run it.
        patience_s: Time without a turn of its loop after which it is killed and restarted.
        robot: Namespace of the one robot that it serves; empty if it serves all of the system's.
        beside: Further namespaces that it serves.
        identity: Who it is on a secured bus.
        carries_all: Whether all others' messages go through it: it starts first and ends last.
    """

    node: str
    arguments: Sequence[str]
    patience_s: float
    robot: str = ""
    beside: tuple[str, ...] = ()
    identity: Identity | None = None
    carries_all: bool = False
    process: subprocess.Popen[bytes] | None = None
    ended: subprocess.Popen[bytes] | None = None
    """The process before, of which something may still run: the robot's sender, that publishes the last messages."""
    started_at: float = 0.0
    failures: int = 0
    restart_at: float | None = None
    seen: bool = False
    missing_since: float | None = None
    heartbeat: HeartbeatWatch | None = None
    hangs: bool = False
    killed: bool = False
    """True if its process has been killed, which on a busy machine may take a while to end."""
    log_begin: int = 0

    @property
    def name(self) -> str:
        """Name for messages to people."""
        return f"{self.node} of {self.robot}" if self.robot else self.node

    @property
    def file_name(self) -> str:
        """Stem of its output and heartbeat files."""
        return f"{self.node}-{self.robot.replace('/', '-')}" if self.robot else self.node

    def notice(self, kind: str, text: str) -> Notice:
        """Return an event of the service; ``text`` follows its name."""
        return Notice(self.node, kind, f"{self.name} {text}", (self.robot,) if self.robot else ())


class Supervisor:
    """Keeps a set of services running; call :meth:`poll` often."""

    def __init__(self, children: Sequence[Child], config: BusConfig, folder: Path, logs: Path) -> None:
        """Prepare without starting anything.

        Args:
            children: The services.
            config: The bus that they join.
            folder: A private folder, where each writes its output, as ``<node>.output``, and its heartbeat.
            logs: Folder of their log files.
        """
        self.children = list(children)
        self._config = config
        self._folder = folder
        self._logs = logs
        self._carried_s: float | None = None
        folder.mkdir(parents=True, exist_ok=True)

    def start_first(self) -> None:
        """Start the processes through which all others' messages go."""
        for child in self.children:
            if child.carries_all:
                self._spawn(child)

    @property
    def carries(self) -> bool:
        """True once these have begun their work."""
        return all(each.heartbeat is not None and each.heartbeat.begun for each in self.children if each.carries_all)

    def start(self) -> None:
        """Start the process of every other service."""
        for child in self.children:
            if not child.carries_all:
                self._spawn(child)

    @property
    def heard(self) -> bool:
        """True if the others hear what is published now."""
        return self._carried_for(_LINKED_S, time.monotonic())

    def poll(self, presences: Mapping[str, Presence] | None = None) -> list[Notice]:
        """Restart what died or hangs; return the events.

        Args:
            presences: The bus's liveliness by robot, already polled; without it only exit codes are watched.
        """
        notices: list[Notice] = []
        now = time.monotonic()
        if not self._carried_for(_UNREACHABLE_S, now):
            presences = None
            for child in self.children:
                child.missing_since = None
        for child in self.children:
            if child.process is None:
                if child.restart_at is not None and now >= child.restart_at:
                    self._spawn(child)
                    notices.append(child.notice("restarted", f"restarted (pid {self.pid(child.node, child.robot)})"))
            elif (code := child.process.poll()) is not None:
                child.ended = child.process
                notices.append(child.notice("died", f"{_how_it_ended(code)}{self._why(child)}{self._log_of(child)}"))
                self._schedule_restart(child, now)
            else:
                notices += self._minded(child, child.process, presences, now)
        return notices

    def _carried_for(self, seconds: float, now: float) -> bool:
        """Return whether the others have been heard for so long: a router that was frozen or away says nothing of them.

        Always true without a router.
        """
        carriers = [child for child in self.children if child.carries_all]
        if not all(each.process is not None and not each.hangs for each in carriers) or not self.carries:
            self._carried_s = None
        elif self._carried_s is None:
            self._carried_s = now
        return not carriers or (self._carried_s is not None and now - self._carried_s > seconds)

    def pid(self, node: str, robot: str = "") -> int | None:
        """Return the process id of ``node``, or of that robot's, if it runs."""
        child = self._child(node, robot)
        return child.process.pid if child is not None and child.process is not None else None

    def log_tail(self, node: str, robot: str = "") -> str:
        """Return the last `_TAIL_LINES` of the output of ``node``, or of that robot's."""
        child = self._child(node, robot)
        if child is None:
            return ""
        path = self._output_path(child)
        text = path.read_text(errors="replace") if path.exists() else ""
        return "\n".join(plain(line) for line in text.splitlines()[-_TAIL_LINES:])

    def stop(self) -> None:
        """Ask every service to end, and kill those that do not."""
        self._stop([child for child in self.children if not child.carries_all])
        self._stop([child for child in self.children if child.carries_all])

    @staticmethod
    def _stop(children: Sequence[Child]) -> None:
        running = [child.process for child in children if child.process is not None]
        for process in running:
            process.terminate()
            process.send_signal(signal.SIGCONT)  # a stopped one could not handle the signal
        deadline = time.monotonic() + _STOP_S
        for process in running:
            with suppress(subprocess.TimeoutExpired):
                process.wait(max(0.0, deadline - time.monotonic()))
            _kill_group(process)
            process.wait()
        for child in children:
            if child.ended is not None:
                _kill_group(child.ended)
            child.process = child.ended = child.restart_at = None

    def _child(self, node: str, robot: str) -> Child | None:
        return next((child for child in self.children if (child.node, child.robot) == (node, robot)), None)

    def _output_path(self, child: Child) -> Path:
        return self._folder / f"{child.file_name}.output"

    def _log_of(self, child: Child) -> str:
        """Return a remark where the log file of an ended process is; "" if there is none."""
        assert child.ended is not None
        path = log_path(self._logs, child.node, self._config_of(child).namespaces, child.ended.pid)
        return f" (log: {path})" if path.exists() else ""

    def _spawn(self, child: Child) -> None:
        if child.ended is not None:
            _kill_group(child.ended)
            child.ended = None
        child.heartbeat = HeartbeatWatch(self._folder / f"{child.file_name}.heartbeat")
        file = open_private(self._output_path(child), os.O_WRONLY | os.O_APPEND)
        with os.fdopen(file, "ab") as log:
            child.log_begin = os.fstat(file).st_size
            child.process = subprocess.Popen(
                # -P: code in the current folder is not ours.
                [
                    *(sys.executable, "-P", "-m", "touchline", *child.arguments),
                    *("--logs", str(self._logs), "--supervisor", str(os.getpid())),
                ],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={
                    **os.environ,
                    **self._config_of(child).environment(),
                    **safe_path(),
                    VARIABLE: str(child.heartbeat.path),
                    "PYTHONUNBUFFERED": "1",
                },
                process_group=0,
            )
        child.started_at = time.monotonic()
        child.restart_at = child.missing_since = None
        child.seen = child.hangs = child.killed = False

    def _config_of(self, child: Child) -> BusConfig:
        served = (child.robot,) if child.robot else self._config.namespaces
        config = self._config.of(*served, *child.beside)
        return config.as_identity(child.identity) if child.identity is not None else config

    def _schedule_restart(self, child: Child, now: float) -> None:
        child.failures = 0 if now - child.started_at > _HEALTHY_S else child.failures + 1
        backoff = min(_FIRST_BACKOFF_S * 2 ** max(0, child.failures - 1), _LONGEST_BACKOFF_S)
        child.process, child.restart_at = None, now + backoff

    def _minded(
        self, child: Child, process: subprocess.Popen[bytes], presences: Mapping[str, Presence] | None, now: float
    ) -> list[Notice]:
        """Look at a running process; kill it, once, if it is of no use any more."""
        if child.killed:
            return []
        output = self._output_path(child)
        if output.stat().st_size > _OUTPUT_BYTES:
            os.truncate(output, 0)
            child.log_begin = 0
        assert child.heartbeat is not None
        heartbeat = child.heartbeat
        heartbeat.look(now, lambda: processor_use(process.pid))
        if not heartbeat.begun and now - child.started_at > _FIRST_BEAT_S:
            return [self._kill(child, process, f"has not begun in {_FIRST_BEAT_S:.0f} s; killed")]
        hung = heartbeat.quiet_s >= HANGS_S
        notices: list[Notice] = []
        if hung and not child.hangs:
            text = f"hangs: its loop has not turned for {heartbeat.quiet_s:.1f} s"
            notices.append(child.notice("hangs", text))
        elif child.hangs and not hung:
            notices.append(child.notice("turns", "turns again"))
        child.hangs = hung
        if heartbeat.quiet_s >= child.patience_s:
            text = f"was killed: its loop has not turned for {heartbeat.quiet_s:.0f} s"
            notices.append(self._kill(child, process, text))
        elif not hung and presences is not None and self._unreachable(child, presences, now):
            text = f"was killed: it left the bus {_UNREACHABLE_S:.0f} s ago but still ran"
            notices.append(self._kill(child, process, text))
        return notices

    @staticmethod
    def _kill(child: Child, process: subprocess.Popen[bytes], text: str) -> Notice:
        child.killed = True
        _kill_group(process)
        return child.notice("hung", text)

    def _unreachable(self, child: Child, presences: Mapping[str, Presence], now: float) -> bool:
        if child.node in presences[self._config_of(child).namespaces[0]].alive():
            child.seen, child.missing_since = True, None
        elif child.seen and child.missing_since is None:
            child.missing_since = now
        return child.missing_since is not None and now - child.missing_since > _UNREACHABLE_S

    def _why(self, child: Child) -> str:
        """Return the last words of a process."""
        with self._output_path(child).open("rb") as log:
            size = log.seek(0, os.SEEK_END)
            log.seek(max(child.log_begin, size - _LAST_WORDS_BYTES))
            lines = [plain(line) for line in log.read().decode(errors="replace").splitlines()]
        words = [line.strip() for line in lines if line.strip()]
        return f": {words[-1]}" if words else ""


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a child and whatever it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
