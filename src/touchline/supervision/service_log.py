"""Log files of services: remarks of all modules, by the standard library's logger `touchline`, in a file each.

They are limited in size and number, and written by a thread of their own: a slow disk, a full one, or a folder that
cannot be written, holds up no robot.
"""

import logging
import os
import platform
import re
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path
from queue import SimpleQueue
from typing import Final

from touchline.schemas.errors import TouchlineError
from touchline.schemas.plain_text import plain_lines
from touchline.schemas.user_folders import state_folder

_LOGGER: Final = logging.getLogger("touchline")
#: A process has two files of this size, the newer and the older one.
_FILE_BYTES: Final = 1_000_000
#: Processes of a name whose files are kept after their end.
_KEPT: Final = 10
_FILE_ONLY: Final = {"file_only": True}


class _Line(logging.Formatter):
    """Formatter of records as text without control sequences: remarks may quote strangers on the bus."""

    converter = staticmethod(time.gmtime)

    def format(self, record: logging.LogRecord) -> str:
        """Return the text of a record; a traceback follows on lines of its own."""
        return plain_lines(super().format(record))


class _LogFile(RotatingFileHandler):
    """File whose failures, such as a full disk, are reported once on standard error."""

    reported = False

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802, as logging calls it
        """Report the error being handled."""
        if not self.reported:
            self.reported = True
            super().handleError(record)


def log_folder() -> Path:
    """Return the folder of log files unless another is chosen: `log` in the user's state folder."""
    return state_folder() / "log"


def log_path(folder: Path, node: str, robots: Sequence[str], pid: int) -> Path:
    """Return the log file of a process.

    Args:
        folder: Folder of log files.
        node: Its name on the bus.
        robots: Namespaces of the robots that it serves.
        pid: Its process id.
    """
    return folder / f"{_stem(node, robots)}-{pid}.log"


def _stem(node: str, robots: Sequence[str]) -> str:
    return f"{node}-{robots[0].replace('/', '-')}" if len(robots) == 1 else node


@contextmanager
def service_log(node: str, robots: Sequence[str], folder: Path | None) -> Iterator[None]:
    """Log to a file until the context is left: information and more, or everything if `touchline` is set to that.

    Standard error gets as much as before. An exception that ends the context, or a thread, is logged, too.

    Args:
        node: Name of this process on the bus.
        robots: Namespaces of the robots that it serves.
        folder: Folder of log files; None: `log_folder`.
    """
    path = log_path(folder or log_folder(), node, robots, os.getpid())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_old(path.parent, _stem(node, robots))
        file = _LogFile(path, maxBytes=_FILE_BYTES, backupCount=1, encoding="utf-8")
    except OSError as error:
        _LOGGER.warning("there is no log file: %s cannot be written: %s", path, error.strerror)
        yield
        return
    file.setFormatter(
        _Line(f"%(asctime)s.%(msecs)03dZ %(levelname)s {node}[%(process)d] %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S")
    )
    shown, usual_level, level = list(_LOGGER.handlers), _LOGGER.level, _LOGGER.getEffectiveLevel()
    for handler in shown:
        handler.setLevel(level)
        handler.addFilter(_for_others)
    records: SimpleQueue[logging.LogRecord] = SimpleQueue()
    listener = QueueListener(records, file, *shown, respect_handler_level=True)
    _LOGGER.handlers[:] = [QueueHandler(records)]
    _LOGGER.setLevel(min(level, logging.INFO))
    usual, threading.excepthook = threading.excepthook, _log_thread_error
    listener.start()
    try:
        _LOGGER.info("started with Python %s for %s", platform.python_version(), ", ".join(robots) or "all robots")
        yield
        _LOGGER.info("ended")
    except TouchlineError as error:
        _LOGGER.error("ended: %s", error, extra=_FILE_ONLY)  # the command line prints it
        raise
    except Exception:
        _LOGGER.critical("ended by an error", exc_info=True, extra=_FILE_ONLY)  # Python prints it
        raise
    finally:
        listener.stop()
        with suppress(OSError):  # a full disk
            file.close()
        threading.excepthook = usual
        _LOGGER.handlers[:] = shown
        _LOGGER.setLevel(usual_level)
        for handler in shown:
            handler.setLevel(logging.NOTSET)
            handler.removeFilter(_for_others)


def _for_others(record: logging.LogRecord) -> bool:
    return not hasattr(record, "file_only")


def _log_thread_error(args: threading.ExceptHookArgs) -> None:
    if args.exc_value is not None and args.exc_type is not SystemExit:
        name = args.thread.name if args.thread is not None else "a thread"
        _LOGGER.critical("%s ended by an error", name, exc_info=args.exc_value)


def _remove_old(folder: Path, stem: str) -> None:
    """Remove the files of all but the last processes of a name that have ended."""
    name = re.compile(rf"{re.escape(stem)}-(\d+)\.log")
    found = [(path, match[1]) for path in folder.iterdir() if (match := name.fullmatch(path.name))]
    ended = [path for path, pid in found if not Path("/proc", pid).exists()]
    for path in sorted(ended, key=_changed_s)[: 1 - _KEPT]:
        for each in (path, path.with_name(f"{path.name}.1")):
            with suppress(OSError):  # another process removes it, too
                each.unlink()


def _changed_s(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
