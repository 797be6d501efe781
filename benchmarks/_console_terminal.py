"""Operator's console as a process in a pseudo-terminal that counts its redraws."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import threading

from benchmarks._processes import cpu_s
from touchline.bus import BusConfig
from touchline.schemas.bus_variables import NAMESPACE_VARIABLE

ASKED_WHETHER_IT_SYNCHRONIZES = b"\x1b[?2026$p"
IT_DOES = b"\x1b[?2026;1$y"
REDRAW = b"\x1b[?2026h"
"""Beginning of a synchronised update of the screen."""


class Terminal:
    """A pseudo-terminal of 120 by 40 with `touchline tui` in it; what that writes is dropped, redraws are counted."""

    def __init__(self, config: BusConfig) -> None:
        """Start the console, for all robots on the bus."""
        self._ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
        environment = {**os.environ, **config.environment(), "TERM": "xterm-256color", "COLORTERM": "truecolor"}
        environment["PYTHONPATH"] = os.pathsep.join(sys.path)
        del environment[NAMESPACE_VARIABLE]
        command = [sys.executable, "-m", "touchline", "tui"]
        self._process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
        os.close(theirs)
        self.redraws = 0
        self._left = threading.Event()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Process id of the console."""
        return self._process.pid

    def _read(self) -> None:
        rest = b""
        while not self._left.is_set():
            if not select.select([self._ours], [], [], 0.1)[0]:
                continue
            try:
                read = os.read(self._ours, 1 << 16)
            except OSError:
                return
            text = rest + read
            if ASKED_WHETHER_IT_SYNCHRONIZES in text:
                os.write(self._ours, IT_DOES)
            self.redraws += text.count(REDRAW)
            rest = text[-len(REDRAW) + 1 :] if not text.endswith(REDRAW) else b""

    def press(self, key: str) -> None:
        """Press one key."""
        os.write(self._ours, key.encode())

    def cpu_s(self) -> float:
        """Processor time of the console so far (s)."""
        return cpu_s(self.pid)

    def leave(self) -> None:
        """End the console's process."""
        self._process.kill()
        self._process.wait()
        self._left.set()
        self._reader.join()
        os.close(self._ours)
