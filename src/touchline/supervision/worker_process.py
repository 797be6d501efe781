"""Worker process that does one task after another for this one."""

from __future__ import annotations

import multiprocessing
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from touchline.supervision.shutdown import ENDS

_ENDING_S = 1.0
Work = Callable[[Any, Any], Any]


class WorkerLost(Exception):
    """The process has ended before its task was done; the text says how."""


class WorkerProcess:
    """Worker process. Spawned, not forked: a fork copies the threads' locks as they happen to be.

    Attributes:
        connection: Readable when the process is ready, has done its task, or has died.
        task: Number of its task; None before it is ready.
    """

    def __init__(self) -> None:
        """Prepare without starting it."""
        context = multiprocessing.get_context("spawn")
        self.connection, self._theirs = context.Pipe()
        self.task: int | None = None
        self._process: multiprocessing.process.BaseProcess | None = None
        self._context = context

    def begin(self, work: Work, shared: Any) -> None:
        """Start the process.

        Args:
            work: A function of a module, so that the process can import it.
            shared: Data shared by all of its tasks.
        """
        process = self._context.Process(target=_serve, args=(self._theirs, work, shared), daemon=True)
        self._process = process
        resource_tracker.ensure_running()  # which the first process starts otherwise, and unblocks signals for it
        with undisturbed():
            process.start()
        self._theirs.close()

    def give(self, number: int, task: Any) -> None:
        """Give it a task with a number."""
        self.task = number
        with suppress(BrokenPipeError, ConnectionResetError):  # it has died; `take` reports that
            self.connection.send(task)

    def take(self) -> Any:
        """Return the result of its task; None at first, when it is ready.

        Raises:
            WorkerLost: It has died.
        """
        try:
            came, error = self.connection.recv()
        except (EOFError, OSError) as lost:  # OSError: it died while sending
            raise WorkerLost(self._end_of_it()) from lost
        if error is not None:
            raise error
        return came

    def _end_of_it(self) -> str:
        assert self._process is not None
        self._process.join(_ENDING_S)
        code = self._process.exitcode or 0
        if code >= 0:
            return f"its process ended with exit code {code}"
        name = signal.Signals(-code).name
        return f"its process was killed ({name}), by the system for want of memory perhaps; try fewer with --workers"

    def end(self) -> None:
        """End the process at once; harmless when repeated."""
        self.connection.close()
        self._theirs.close()
        if self._process is None or self._process.pid is None:
            return
        if self.task is not None:
            self._process.terminate()
            self._process.join(_ENDING_S)
        if self._process.exitcode is None:  # it hangs, or does not handle signals yet, as it does not serve
            self._process.kill()
            self._process.join()


def _serve(connection: Connection, work: Work, shared: Any) -> None:
    """Do tasks until the connection closes; Ctrl-C is left to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDS)
    try:
        connection.send((None, None))
        while True:
            _answer(connection, work, shared, connection.recv())
    except (EOFError, BrokenPipeError, ConnectionResetError):  # the parent needs no more, or is gone
        return


def _answer(connection: Connection, work: Work, shared: Any, task: Any) -> None:
    try:
        came = work(shared, task)
    except Exception as error:  # noqa: BLE001, raised again where the task came from
        error.add_note(traceback.format_exc())
        try:
            connection.send((None, error))
        except (TypeError, AttributeError, ValueError):  # it cannot be sent
            connection.send((None, RuntimeError(traceback.format_exc())))
    else:
        connection.send((came, None))


@contextmanager
def undisturbed() -> Iterator[None]:
    """Defer termination signals here, and in a process started meanwhile until it serves.

    A process gets its data through a pipe, and would complain about missing ones.
    """
    came: list[int] = []
    handlers: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # which is interrupted whatever thread has the signal
        handlers = {number: signal.getsignal(number) for number in ENDS if callable(signal.getsignal(number))}
    for number in handlers:
        signal.signal(number, lambda number, _frame: came.append(number))
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ENDS)  # for the new process, which takes this over
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for number in came:
        signal.raise_signal(number)
