"""Pools for independent tasks: this process, several processes, or a Dask cluster.

Data shared by all tasks are sent to each process once. A task whose process dies is reported, and the others continue.
"""

import logging
import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any, TypeVar

from touchline.schemas.errors import TouchlineError
from touchline.security.identity import Identity
from touchline.supervision.worker_process import WorkerLost, WorkerProcess

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Done = TypeVar("Done")
Work = Callable[[Shared, Task], Done]
"""A function of a module, so that any process can import it: (shared data, task) → result."""
Lost = Callable[[Task, str], Done]
"""(task, reason) → result of a task whose process died."""

_ANSWER_S = 10.0


def here(work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task]) -> Generator[Done, None, None]:
    """Perform the tasks one after the other in this process."""
    for task in tasks:
        yield work(shared, task)


def spread(
    work: Work[Shared, Task, Done],
    shared: Shared,
    tasks: Sequence[Task],
    workers: int | None,
    lost: Lost[Task, Done],
) -> Generator[Done, None, None]:
    """Perform the tasks in this process or in several; see `in_processes`.

    Args:
        work: Function that does a task.
        shared: Data shared by all tasks.
        tasks: The tasks.
        workers: Number of processes; None: one per core.
        lost: Result of a task whose process died.

    Raises:
        TouchlineError: Not one process starts.
    """
    count = min(workers or cores(), len(tasks))
    return in_processes(work, shared, tasks, count, lost) if count > 1 else here(work, shared, tasks)


def in_processes(
    work: Work[Shared, Task, Done], shared: Shared, tasks: Sequence[Task], workers: int, lost: Lost[Task, Done]
) -> Generator[Done, None, None]:
    """Perform the tasks in ``workers`` processes; yield results as they finish. Closing the iterator early stops them.

    Args:
        work: Function that does a task.
        shared: Data shared by all tasks.
        tasks: The tasks.
        workers: Number of processes.
        lost: Result of a task whose process died.

    Raises:
        TouchlineError: Not one process starts.
    """
    pool = _Pool(work, shared, tasks)
    try:
        for _ in range(min(workers, len(tasks))):
            pool.begin()
        while pool.remaining:
            for worker, number in pool.ready():
                try:
                    came = pool.take(worker)
                except WorkerLost as error:
                    came = lost(tasks[number], str(error)) if number >= 0 else None
                if number >= 0:
                    pool.remaining -= 1
                    yield came
    finally:
        pool.end()


class _Pool:
    """Processes that get one task after the other, in order.

    Attributes:
        remaining: Tasks without a result.
    """

    def __init__(self, work: Work[Any, Any, Any], shared: Any, tasks: Sequence[Any]) -> None:
        self._work, self._shared, self._tasks = work, shared, tasks
        self._workers: list[WorkerProcess] = []
        self._given, self.remaining = 0, len(tasks)

    def begin(self) -> None:
        """Start one more process."""
        self._workers.append(WorkerProcess())  # first, so that it is ended if this is interrupted
        self._workers[-1].begin(self._work, self._shared)

    def ready(self) -> list[tuple[WorkerProcess, int]]:
        """Return processes with a result, and the index of its task; −1: the process has started."""
        readable = wait([worker.connection for worker in self._workers])
        ready = [worker for worker in self._workers if worker.connection in readable]
        return [(worker, -1 if worker.task is None else worker.task) for worker in ready]

    def take(self, worker: WorkerProcess) -> Any:
        """Return the result of a process's task; give it the next one, or end it.

        Raises:
            WorkerLost: It has died. A new one replaces it if it had a task; otherwise the others do without.
            TouchlineError: It has died before it had a task, and there is no other process.
        """
        more = self._given < len(self._tasks)
        try:
            came = worker.take()
        except WorkerLost as error:
            self._dismiss(worker)
            if worker.task is None and not self._workers:
                raise TouchlineError(f"no task can be done: {error}") from error
            if worker.task is not None and more:
                self.begin()
            raise
        if more:
            worker.give(self._given, self._tasks[self._given])
            self._given += 1
        else:
            self._dismiss(worker)
        return came

    def _dismiss(self, worker: WorkerProcess) -> None:
        worker.end()
        self._workers.remove(worker)

    def end(self) -> None:
        """End all processes at once."""
        for worker in self._workers:
            worker.end()


@dataclass(frozen=True)
class DaskScheduler:
    """Scheduler of Dask, whose workers need this version of Touchline.

    Attributes:
        address: ``tls://scheduler:8786``, or ``tcp://…`` without TLS.
        identity: By whose certificate the scheduler admits this process; None without TLS, or with Dask's own settings.
    """

    address: str
    identity: Identity | None = None


def on_dask(
    work: Work[Shared, Task, Done],
    shared: Shared,
    tasks: Sequence[Task],
    scheduler: DaskScheduler,
    lost: Lost[Task, Done],
) -> Generator[Done, None, None]:
    """Perform the tasks on the workers of a Dask scheduler.

    Dask gives the task of a worker that died to another one; `lost` is for tasks that killed several.

    Args:
        work: Function that does a task.
        shared: Data shared by all tasks.
        tasks: The tasks.
        scheduler: The scheduler.
        lost: Result of a task that killed several workers.

    Raises:
        TouchlineError: The scheduler does not answer, or not any more.
    """
    from distributed import Client, KilledWorker, Security
    from distributed import as_completed as completed

    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors report what matters
    address, identity, security = scheduler.address, scheduler.identity, None
    if identity is not None:
        security = Security(
            require_encryption=True,
            tls_ca_file=str(identity.authority),
            tls_client_cert=str(identity.certificate),
            tls_client_key=str(identity.key),
        )
    try:
        client = Client(address, timeout=f"{_ANSWER_S}s", security=security)
    except (OSError, ValueError, TypeError) as error:  # the last one is for tls:// without certificates
        raise TouchlineError(f"no Dask scheduler answers at {address}: {_with_cause(error)}") from error
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


def _with_cause(error: BaseException) -> str:
    """Return an error's text, and in brackets that of its first cause, such as a certificate that is not trusted."""
    first = error
    while first.__cause__ is not None:
        first = first.__cause__
    return f"{error}" if first is error else f"{error} ({first})"


def _on_worker(task: Task, work: Work[Shared, Task, Done], shared: Shared) -> Done:
    return work(shared, task)


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
