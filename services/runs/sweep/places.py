"""Executors of a sweep: this process, a pool of processes, or a Dask cluster."""

import multiprocessing
import os
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

from touchline.schemas.errors import TouchlineError
from touchline.services.runs.sweep.task import (
    SweepJob,
    SweepRun,
    Task,
    begin_worker,
    perform,
    perform_in_worker,
    undisturbed,
)


def here(jobs: list[SweepJob], tasks: Sequence[Task]) -> Generator[SweepRun, None, None]:
    """Perform the tasks one after the other in this process."""
    for task in tasks:
        yield perform(jobs, task)


def in_processes(jobs: list[SweepJob], tasks: Sequence[Task], workers: int) -> Generator[SweepRun, None, None]:
    """In ``workers`` processes, as they finish. Closing the iterator early stops them.

    Raises:
        TouchlineError: One was killed, by the system for want of memory perhaps.
    """
    # Spawned, not forked: a fork copies the threads' locks as they happen to be.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(tasks)), context, begin_worker, (jobs,))
    futures: list[Future[SweepRun]] = []
    try:
        for task in tasks:
            with undisturbed():  # it may start a process
                futures.append(pool.submit(perform_in_worker, task))
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool as error:
        raise TouchlineError("a process of the sweep was killed; try fewer with --workers") from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()


def on_dask(jobs: list[SweepJob], tasks: Sequence[Task], address: str) -> Generator[SweepRun, None, None]:
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
        shared = client.scatter([jobs], broadcast=True)[0]
        futures = client.map(_perform, list(tasks), jobs=shared, pure=False)
        try:
            for future in completed(futures):
                yield future.result()
        except KilledWorker as error:
            raise TouchlineError(f"workers of {address} were killed, one after another, by the same run") from error
        finally:
            client.cancel(futures)


def _perform(task: Task, jobs: list[SweepJob]) -> SweepRun:
    return perform(jobs, task)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
