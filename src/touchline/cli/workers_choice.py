"""The options of commands that do many independent tasks: how many processes, or whose."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.optional_packages import require

if TYPE_CHECKING:
    from touchline.jobs.places import Done, Lost, Shared, Task, Work


@dataclass(frozen=True)
class WorkersChoice:
    """Which processes do the tasks."""

    workers: Annotated[int, typer.Option(metavar="N", help="Processes; 0: one for each core.", min=0)] = 0
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler, to use its workers instead.", show_default=False
        ),
    ] = None

    def __post_init__(self) -> None:
        """Refuse workers that cannot be reached from here.

        Raises:
            TouchlineError: Dask is not installed.
        """
        if self.dask is not None:
            require("distributed", "--dask")

    def done(
        self, work: "Work[Shared, Task, Done]", shared: "Shared", tasks: "Sequence[Task]", lost: "Lost[Task, Done]"
    ) -> Generator["Done", None, None]:
        """What came of each task as it is done; closing the iterator early stops the others.

        `lost` makes what is said of a task whose process died.
        """
        from touchline.jobs.places import cores, here, in_processes, on_dask

        if self.dask is not None:
            return on_dask(work, shared, tasks, self.dask, lost)
        count = min(self.workers or cores(), len(tasks))
        return in_processes(work, shared, tasks, count, lost) if count > 1 else here(work, shared, tasks)
