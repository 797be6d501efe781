"""Where independent tasks are done: in this process, in several, or on a Dask cluster.

What all tasks have in common is handed to each process once. A task whose process dies is told, and the others go on.
"""

import logging
import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from multiprocessing.connection import wait
from typing import TypeVar

from touchline.schemas.errors import TouchlineError
from touchline.services.runs.worker_process import WorkerLost, WorkerProcess

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Done = TypeVar("Done")
Work = Callable[[Shared, Task], Done]
"""A function of a module, so that any process finds it: from what is shared and a task to what came of it."""
Lost = Callable[[Task, str], Done]
"""What is to be said of a task whose process died, and why it did."""

_ANSWER_S = 10.0


def here(work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task]) -> Generator[Done, None, None]:
    """Perform the tasks one after the other in this process."""
    for task in tasks:
        yield work(shared, task)


def in_processes(
    work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task], workers: int, lost: Lost[Task, Done]
) -> Generator[Done, None, None]:
    """In ``workers`` processes, as they finish. Closing the iterator early stops them.

    Raises:
        TouchlineError: A process does not even start.
    """
    pool: list[WorkerProcess] = []

    def begin() -> None:
        pool.append(WorkerProcess())  # first, so that it is ended if this is interrupted
        pool[-1].begin(work, shared)

    given = left = 0
    try:
        for _ in range(min(workers, len(tasks))):
            begin()
        while left < len(tasks):
            ready = wait([worker.connection for worker in pool])
            for worker in [each for each in pool if each.connection in ready]:
                number = worker.task
                try:
                    came = worker.take()
                except WorkerLost as error:
                    if number is None:
                        raise TouchlineError(f"no task can be done: {error}") from error
                    worker.end()
                    pool.remove(worker)
                    if given < len(tasks):
                        begin()
                    came = lost(tasks[number], str(error))
                else:
                    if given < len(tasks):
                        worker.give(given, tasks[given])
                        given += 1
                    else:
                        worker.end()
                        pool.remove(worker)
                if number is not None:
                    left += 1
                    yield came
    finally:
        for worker in pool:
            worker.end()


def on_dask(
    work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task], address: str, lost: Lost[Task, Done]
) -> Generator[Done, None, None]:
    """On the workers of the Dask scheduler at ``address``, which need this version of Touchline installed.

    Dask gives the task of a worker that died to another one; `lost` is of those that killed several.

    Raises:
        TouchlineError: Dask is not installed, or the scheduler does not answer, or not any more.
    """
    try:
        from distributed import Client, KilledWorker
        from distributed import as_completed as completed
    except ImportError as error:
        raise TouchlineError("--dask needs Dask: pip install 'touchline[sweep]'") from error
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what they have to say is told by errors
    try:
        client = Client(address, timeout=f"{_ANSWER_S}s")
    except (OSError, ValueError, TypeError) as error:  # the last for tls:// without certificates
        raise TouchlineError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        there = client.scatter([shared], broadcast=True)[0]
        futures = client.map(_on_worker, list(tasks), work=work, shared=there, pure=False)
        task_of = {future.key: task for future, task in zip(futures, tasks, strict=True)}
        try:
            for future in completed(futures):
                try:
                    yield future.result()
                except KilledWorker:
                    yield lost(task_of[future.key], f"it killed one worker of {address} after another")
        except (CancelledError, OSError) as error:
            raise TouchlineError(f"the Dask scheduler at {address} is gone") from error
        finally:
            client.cancel(futures)


def _on_worker(task: Task, work: Work[Shared, Task, Done], shared: Shared) -> Done:
    return work(shared, task)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
