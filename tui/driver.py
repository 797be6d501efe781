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
"""Key of the emergency stop, which works everywhere, also in text fields."""
HUNG_UP = 128 + signal.SIGHUP
"""Exit code of a console whose terminal is gone."""


@runtime_checkable
class Stoppable(Protocol):
    """Console that takes an emergency stop from the thread that reads the keys."""

    def stop_at_once(self, typed_s: float) -> None:
        """Stop the robots; the key was typed at `typed_s` (monotonic)."""


class Screen:
    """Output to the terminal that ignores errors once the terminal is gone.

    Textual's writing thread would end with the error, and later writers would wait for it for ever.
    """

    def __init__(self, file: TextIO) -> None:
        """Wrap ``file``."""
        self._file = file

    def write(self, text: str) -> int:
        """Write, if possible."""
        try:
            return self._file.write(text)
        except OSError:
            return len(text)

    def flush(self) -> None:
        """Flush, if possible."""
        with suppress(OSError):
            self._file.flush()

    def isatty(self) -> bool:
        """True, so that Textual uses the terminal."""
        return True

    def fileno(self) -> int:
        """File descriptor of the terminal."""
        return self._file.fileno()


class SturdyDriver(LinuxDriver):
    """Textual's driver that survives input that is not UTF-8, and ends the console when its terminal closes.

    At line noise, a pasted binary or a terminal of another encoding Textual's driver ends the whole console, and with
    it the operator's emergency stop; here that input is dropped. On a closed terminal Textual's driver reads nothing
    for ever, or waits for ever to write; here the console ends.

    Textual's key thread wakes the console for each key, and may have to wait for the interpreter afterwards. Here the
    console is woken once for all pending keys, so that an emergency stop behind many keys is read at once.
    """

    def __init__(self, app: App[Any], **options: Any) -> None:
        """Create the driver with Textual's arguments."""
        super().__init__(app, **options)
        self._watching = False
        self._typed = deque[Message]()
        self._woken = False

    def process_message(self, message: Message) -> None:
        """Pass keys on; an emergency stop at once, from this thread, before earlier keys."""
        if isinstance(message, Key) and message.key == STOP_KEY and isinstance(self._app, Stoppable):
            self._app.stop_at_once(message.time)
        self._typed.append(message)
        if not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._hand_on)

    def _hand_on(self) -> None:
        """Pass pending keys to the console."""
        self._woken = False  # before the last key is taken, so that later ones wake the console again
        while self._typed:
            super().process_message(self._typed.popleft())

    def start_application_mode(self) -> None:
        """Take over the terminal, and watch it."""
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
            except OSError:  # the terminal is gone, which `watch_terminal` sees, too
                return

    def watch_terminal(self) -> None:
        """Wait until the terminal is gone, then end the console."""
        hang_up = select.poll()
        hang_up.register(self.fileno, 0)
        hang_up.poll()
        self.exit_event.set()
        self._app.call_later(self._app.exit, return_code=HUNG_UP)
