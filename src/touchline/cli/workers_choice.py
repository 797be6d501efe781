"""Options of commands with many independent tasks: number of processes, or a Dask scheduler."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.optional_packages import require

if TYPE_CHECKING:
    from touchline.jobs.task_pool import Done, Lost, Shared, Task, Work


@dataclass(frozen=True)
class WorkersChoice:
    """Workers of a command's tasks."""

    workers: Annotated[int, typer.Option(metavar="N", help="Number of processes (0: one per core).", min=0)] = 0
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Address of a Dask scheduler whose workers to use instead.")
    ] = None

    def __post_init__(self) -> None:
        """Refuse Dask if it is not installed.

        Raises:
            TouchlineError: Dask is not installed.
        """
        if self.dask is not None:
            require("distributed", "--dask")

    def done(
        self, work: "Work[Shared, Task, Done]", shared: "Shared", tasks: "Sequence[Task]", lost: "Lost[Task, Done]"
    ) -> Generator["Done", None, None]:
        """Yield the result of each task as it finishes; closing the iterator early stops the others.

        `lost` makes the result of a task whose process died.
        """
        from touchline.jobs.task_pool import on_dask, spread

        if self.dask is not None:
            return on_dask(work, shared, tasks, self.dask, lost)
        return spread(work, shared, tasks, self.workers or None, lost)
