"""Options of commands with many independent tasks: number of processes, or a Dask scheduler."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final
from urllib.parse import urlsplit

import typer

from touchline.schemas.bus_variables import is_open_to_network
from touchline.schemas.errors import SpecError
from touchline.schemas.loopback import is_loopback_host
from touchline.schemas.optional_packages import require

if TYPE_CHECKING:
    from touchline.jobs.task_pool import DaskScheduler, Done, Lost, Shared, Task, Work

_ENCRYPTED: Final = ("tls", "wss")


@dataclass(frozen=True)
class WorkersChoice:
    """Workers of a command's tasks."""

    workers: Annotated[int, typer.Option(metavar="N", help="Number of processes (0: one per core).", min=0)] = 0
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler whose workers to use instead: tls://scheduler:8786."
        ),
    ] = None
    dask_identity: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Identity for a scheduler with TLS: a name of `touchline keys list`, or a folder."
        ),
    ] = None

    def __post_init__(self) -> None:
        """Refuse Dask if it is not installed, and a scheduler that cannot be used.

        Raises:
            TouchlineError: Dask is not installed.
            SpecError: The scheduler is on another machine and there is no TLS, or address and identity do not fit.
        """
        if self.dask is not None:
            require("distributed", "--dask")
            self._check(self.dask)
        elif self.dask_identity is not None:
            raise SpecError("command line", "--dask-identity", "is given without a scheduler", "give --dask, too")

    def _check(self, address: str) -> None:
        try:
            parts = urlsplit(address if "://" in address else f"tcp://{address}")
        except ValueError as error:
            raise SpecError(
                "command line", "--dask", f"is {address!r}", "give one like tls://scheduler:8786"
            ) from error
        if parts.scheme in _ENCRYPTED:
            return
        if self.dask_identity is not None:
            remedy = "give an address with TLS, such as tls://scheduler:8786, or leave out --dask-identity"
            raise SpecError("command line", "--dask", f"is {address}", remedy)
        if not is_loopback_host(parts.hostname or "") and not is_open_to_network():
            problem = f"is {address}, beyond this machine and without TLS"
            remedy = (
                "give tls://… and --dask-identity NAME, or --open-to-network: then anybody there runs programs on "
                "scheduler and workers"
            )
            raise SpecError("command line", "--dask", problem, remedy)

    def _scheduler(self, address: str) -> "DaskScheduler":
        from touchline.jobs.task_pool import DaskScheduler
        from touchline.security.identity import Identity

        return DaskScheduler(address, Identity.load(self.dask_identity) if self.dask_identity is not None else None)

    def done(
        self, work: "Work[Shared, Task, Done]", shared: "Shared", tasks: "Sequence[Task]", lost: "Lost[Task, Done]"
    ) -> Generator["Done", None, None]:
        """Yield the result of each task as it finishes; closing the iterator early stops the others.

        `lost` makes the result of a task whose process died.
        """
        from touchline.jobs.task_pool import on_dask, spread

        if self.dask is not None:
            return on_dask(work, shared, tasks, self._scheduler(self.dask), lost)
        return spread(work, shared, tasks, self.workers or None, lost)
