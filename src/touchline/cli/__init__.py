"""The ``touchline`` command."""

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

#: An interruption that comes while kernels are compiled, or that Python has to ignore, comes again after this long.
_AGAIN_S = 0.02


def main() -> None:
    """Run the command, and end it in good order at Ctrl-C, SIGTERM and hang-up, also while it is still being loaded."""
    os.environ.update(safe_path())  # for the supervisor's children and the processes of a sweep
    told: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        told.append(number)
        if not _compiling():
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)

    def lost(ignored: "sys.UnraisableHookArgs") -> None:
        if ignored.exc_type is KeyboardInterrupt and told:
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
    signal.signal(signal.SIGALRM, lambda _number, frame: end(told[-1], frame))
    try:
        code = execute()
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    except Exception:
        if not told:
            raise
        code = 128 + signal.SIGINT  # Numba trips over itself when it is interrupted while it compiles
    if told and code == 128 + signal.SIGINT:
        _leave(told[-1])
    if code == 128 + signal.SIGHUP:
        _exit(code)  # what is left for a terminal that has gone cannot be written, which Python would exit with 120 for
    if any(thread.daemon for thread in threading.enumerate()):
        _exit(code)  # a thread that leaves a bus where somebody is frozen; cut off inside Zenoh, it would crash us
    sys.exit(code)


def _compiling() -> bool:
    """Whether this thread is in Numba's compiler, which an exception from outside can crash."""
    module = sys.modules.get("numba.core.compiler_lock")
    return module is not None and bool(module.global_compiler_lock.is_locked())


def _leave(number: int) -> NoReturn:
    """End here, all being in order: the interpreter's own way out takes some interruptions for SIGINT unhandled."""
    sys.stderr.write("interrupted\n")
    _exit(128 + number)


def _exit(code: int) -> NoReturn:
    """End without the interpreter's own way out; everything has been closed."""
    with suppress(OSError):  # nobody reads it any more
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


__all__ = ["main"]
