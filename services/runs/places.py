"""Where independent tasks are done: in this process, a pool of processes, or a Dask cluster.

What all tasks have in common is handed to each process once.
"""

import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from touchline.schemas.errors import TouchlineError
from touchline.services.system.shutdown import ENDS

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Done = TypeVar("Done")
Work = Callable[[Shared, Task], Done]
"""A function of a module, so that any process finds it: from what is shared and a task to what came of it."""

_work: list[tuple[Work[Any, Any, Any], Any]] = []
"""Of this process of a pool."""


def here(work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task]) -> Generator[Done, None, None]:
    """Perform the tasks one after the other in this process."""
    for task in tasks:
        yield work(shared, task)


def in_processes(
    work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task], workers: int
) -> Generator[Done, None, None]:
    """In ``workers`` processes, as they finish. Closing the iterator early stops them.

    Raises:
        TouchlineError: One was killed, by the system for want of memory perhaps.
    """
    # Spawned, not forked: a fork copies the threads' locks as they happen to be.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(tasks)), context, begin_worker, (work, shared))
    futures: list[Future[Done]] = []
    try:
        for task in tasks:
            with undisturbed():  # it may start a process
                futures.append(pool.submit(perform_in_worker, task))
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool as error:
        raise TouchlineError("a process was killed; try fewer with --workers") from error
    finally:
        _end(pool)
        del pool, futures
        gc.collect()  # its semaphores, which a process that ends at once would leave to be complained of


def _end(pool: ProcessPoolExecutor) -> None:
    """End its processes, whatever they do."""
    for process in multiprocessing.active_children():
        process.terminate()
    pool.shutdown(wait=True, cancel_futures=True)


def on_dask(
    work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task], address: str
) -> Generator[Done, None, None]:
    """On the workers of the Dask scheduler at ``address``, which need this version of Touchline installed.

    Raises:
        TouchlineError: Dask is not installed, the scheduler does not answer, or a run killed one worker after another.
    """
    try:
        from distributed import Client, KilledWorker
        from distributed import as_completed as completed
    except ImportError as error:
        raise TouchlineError("--dask needs Dask: pip install 'touchline[sweep]'") from error
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError, TypeError) as error:  # the last for tls:// without certificates
        raise TouchlineError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        there = client.scatter([shared], broadcast=True)[0]
        futures = client.map(_on_worker, list(tasks), work=work, shared=there, pure=False)
        try:
            for future in completed(futures):
                yield future.result()
        except KilledWorker as error:
            raise TouchlineError(f"workers of {address} were killed, one after another, by the same task") from error
        finally:
            client.cancel(futures)


def _on_worker(task: Task, work: Work[Shared, Task, Done], shared: Shared) -> Done:
    return work(shared, task)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def undisturbed() -> Iterator[None]:
    """Defer termination signals here, and in a process started meanwhile until its :func:`begin_worker`.

    A process of a pool gets what it needs through a pipe, and would complain of what is missing.
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


def begin_worker(work: Work[Shared, Task, Done], shared: Shared) -> None:
    """Initialise a process of a pool, which leaves Ctrl-C to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDS)
    _work[:] = [(work, shared)]


def perform_in_worker(task: Task) -> Any:
    """Do a task with what the process was given at its beginning."""
    work, shared = _work[0]
    return work(shared, task)
