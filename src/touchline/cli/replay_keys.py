"""Keys that control a replay from its own terminal."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Final

from touchline.recordings.replay.replay_player import ReplayPlayer
from touchline.schemas.replay_steps import FAR_SEEK_S, REPLAY_SPEEDS, SEEK_S, STEP_S, next_speed

HELP: Final = "space pause  ←→ 10 s  ↓↑ 60 s  . step  +- speed  q quit"
_READ_BYTES: Final = 64


class ReplayKeys:
    """Keys of a terminal, applied to a replay.

    Attributes:
        quit: Whether the user has asked to end it.
    """

    def __init__(self, terminal: int | None = None) -> None:
        """Read keys from the terminal with this file descriptor; None: no keys."""
        self._terminal = terminal
        self.quit = False

    @property
    def there(self) -> bool:
        """True if there is a terminal to read from."""
        return self._terminal is not None

    def poll(self, player: ReplayPlayer) -> None:
        """Apply the keys typed since the last call."""
        if self._terminal is None or not select.select([self._terminal], [], [], 0.0)[0]:
            return
        typed = os.read(self._terminal, _READ_BYTES)
        if not typed:  # the terminal is gone
            self._terminal = None
        self.press(typed, player)

    def press(self, typed: bytes, player: ReplayPlayer) -> None:
        """Apply the keys encoded by these bytes; unknown ones are ignored."""
        while typed:
            key = next((key for key in _KEYS if typed.startswith(key)), typed[:1])
            typed = typed[len(key) :]
            if key == b"q":
                self.quit = True
            elif key in _KEYS:
                _KEYS[key](player)


@contextmanager
def replay_keys() -> Iterator[ReplayKeys]:
    """Yield the keys of standard input, none if it is no terminal; the terminal's mode is restored at the end."""
    if not sys.stdin.isatty() or os.tcgetpgrp(sys.stdin.fileno()) != os.getpgrp():  # in the background it would stop
        yield ReplayKeys()
        return
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    try:
        yield ReplayKeys(terminal)
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _toggle(player: ReplayPlayer) -> None:
    if player.playing:
        player.pause()
    else:
        player.resume()


def _seek(by_s: float, player: ReplayPlayer) -> None:
    player.seek(player.now_s + by_s)


def _change_speed(steps: int, player: ReplayPlayer) -> None:
    player.set_speed(next_speed(REPLAY_SPEEDS, player.speed, steps))


_KEYS: Mapping[bytes, Callable[[ReplayPlayer], None]] = {
    b"\x1b[D": partial(_seek, -SEEK_S),
    b"\x1b[C": partial(_seek, SEEK_S),
    b"\x1b[B": partial(_seek, -FAR_SEEK_S),
    b"\x1b[A": partial(_seek, FAR_SEEK_S),
    b"\x1bOD": partial(_seek, -SEEK_S),
    b"\x1bOC": partial(_seek, SEEK_S),
    b"\x1bOB": partial(_seek, -FAR_SEEK_S),
    b"\x1bOA": partial(_seek, FAR_SEEK_S),
    b" ": _toggle,
    b".": lambda player: player.step(seconds=STEP_S),
    b"+": partial(_change_speed, 1),
    b"=": partial(_change_speed, 1),
    b"-": partial(_change_speed, -1),
}
