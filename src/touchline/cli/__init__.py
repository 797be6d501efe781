"""The ``touchline`` command: entry point, interruptions and exit."""

import gc
import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType
from typing import NoReturn

from touchline.cli.garbage import without_collecting
from touchline.supervision.safe_path import safe_path
from touchline.supervision.shutdown import ENDS

#: How soon an interruption is repeated that arrives while kernels compile, or that Python has to ignore.
_AGAIN_S = 0.02


def main() -> None:
    """Run the command; end cleanly at Ctrl-C, SIGTERM and hang-up, even while it is still being loaded."""
    os.environ.update(safe_path())  # for the supervisor's children and the processes of a sweep
    signals: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        signals.append(number)
        if not _compiling():
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)

    def lost(ignored: "sys.UnraisableHookArgs") -> None:
        if ignored.exc_type is KeyboardInterrupt and signals:
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        else:
            sys.__unraisablehook__(ignored)

    heard = [number for number in ENDS if signal.getsignal(number) is not signal.SIG_IGN]  # as under nohup
    for number in heard:
        signal.signal(number, lambda number, frame: _leave(number))  # an exception could get lost in an import
    with without_collecting():
        if sys.argv[1:] in ([], ["-h"], ["--help"]):
            from touchline.cli.overview import overview

            overview()()
        from touchline.cli.commands import execute
    gc.freeze()  # modules stay to the end; no later collection need go through them

    for number in heard:
        signal.signal(number, end)
    sys.unraisablehook = lost
    signal.signal(signal.SIGALRM, lambda _number, frame: end(signals[-1], frame))
    try:
        code = execute()
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    except Exception:
        if not signals:
            raise
        code = 128 + signal.SIGINT  # Numba trips over itself when it is interrupted while it compiles
    if signals and code == 128 + signal.SIGINT:
        _leave(signals[-1])
    if code == 128 + signal.SIGHUP:
        _exit(code)  # output still buffered for a closed terminal cannot be written; Python would exit with 120 for it
    if any(thread.daemon for thread in threading.enumerate()):
        _exit(code)  # a thread may still be leaving a bus with a hung peer; cut off inside Zenoh, it would crash us
    sys.exit(code)


def _compiling() -> bool:
    """Return whether this thread is in Numba's compiler, which an exception from outside can crash."""
    module = sys.modules.get("numba.core.compiler_lock")
    return module is not None and bool(module.global_compiler_lock.is_locked())


def _leave(number: int) -> NoReturn:
    """Exit with all streams flushed: Python's own exit reports some interruptions as an unhandled SIGINT."""
    sys.stderr.write("interrupted\n")
    _exit(128 + number)


def _exit(code: int) -> NoReturn:
    """Exit at once, without Python's own clean-up; everything has been closed."""
    with suppress(OSError):  # the reader is gone
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


__all__ = ["main"]
