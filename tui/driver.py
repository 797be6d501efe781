"""Terminal driver: emergency stop from the reading thread, invalid UTF-8, and loss of the terminal."""

from __future__ import annotations

import select
import signal
import sys
import threading
from collections import deque
from contextlib import suppress
from typing import Any, Final, Protocol, TextIO, runtime_checkable

from textual.app import App
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key
from textual.message import Message

STOP_KEY: Final = "ctrl+e"
"""It stops the robots wherever it is typed, also in a field of text."""
HUNG_UP = 128 + signal.SIGHUP
"""Exit code of a console whose terminal is gone."""


@runtime_checkable
class Stoppable(Protocol):
    """A console that takes an emergency stop from the thread that reads the keys."""

    def stop_at_once(self, typed_s: float) -> None:
        """Stop the robot; the key was typed at this time (monotonic)."""


class Screen:
    """Where the terminal's picture is written; once the terminal is gone, what is written is lost without an error.

    Textual's writing thread would end with the error, and the next writers would wait for it for ever.
    """

    def __init__(self, file: TextIO) -> None:
        """Write to ``file``."""
        self._file = file

    def write(self, text: str) -> int:
        """Write, if it can be."""
        try:
            return self._file.write(text)
        except OSError:
            return len(text)

    def flush(self) -> None:
        """Flush, if it can be."""
        with suppress(OSError):
            self._file.flush()

    def isatty(self) -> bool:
        """As far as Textual is concerned."""
        return True

    def fileno(self) -> int:
        """Of the terminal."""
        return self._file.fileno()


class SturdyDriver(LinuxDriver):
    """Textual's own, but for input that is no UTF-8 and for a terminal that is closed.

    The first is line noise, a pasted binary, a terminal of another encoding: Textual's ends the whole console, and with
    it the operator's emergency stop. Here what was read with it is dropped. Of a closed terminal Textual's reads
    nothing for ever, or waits for ever to write to it. Here the console ends.

    Textual's thread that reads the keys wakes the console for each, and may have to wait for the interpreter after it.
    Here the console is woken once for all that have come, so that an emergency stop behind many keys is read at once.
    """

    def __init__(self, app: App[Any], **options: Any) -> None:
        """As Textual makes it."""
        super().__init__(app, **options)
        self._watching = False
        self._typed = deque[Message]()
        self._woken = False

    def process_message(self, message: Message) -> None:
        """Hand on what was typed; an emergency stop at once, from this thread, before what was typed earlier."""
        if isinstance(message, Key) and message.key == STOP_KEY and isinstance(self._app, Stoppable):
            self._app.stop_at_once(message.time)
        self._typed.append(message)
        if not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._hand_on)

    def _hand_on(self) -> None:
        """Give the console what was typed."""
        self._woken = False  # before the last is taken: what comes after that wakes it anew
        while self._typed:
            super().process_message(self._typed.popleft())

    def start_application_mode(self) -> None:
        """Take over the terminal."""
        if not self._watching:
            self._watching = True
            self._file = Screen(sys.__stderr__ or sys.stderr)  # type: ignore[assignment]
            threading.Thread(target=self.watch_terminal, name="terminal-watch", daemon=True).start()
        super().start_application_mode()  # type: ignore[no-untyped-call]

    def run_input_thread(self) -> None:
        """Read until the console is left or the terminal is gone."""
        while not self.exit_event.is_set():
            try:
                super().run_input_thread()
            except UnicodeDecodeError:
                continue
            except OSError:  # nothing can be read any more: it is gone, which `watch_terminal` sees, too
                return

    def watch_terminal(self) -> None:
        """Wait until the terminal is gone, then end the console."""
        hang_up = select.poll()
        hang_up.register(self.fileno, 0)
        hang_up.poll()
        self.exit_event.set()
        self._app.call_later(self._app.exit, return_code=HUNG_UP)
