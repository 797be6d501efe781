"""Memory of a team's coordinator: what another one needs to go on with the team's task, on the bus and on disk.

Nothing in it decides how robots keep apart: that is what they say themselves.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Final

from touchline.bus import Bus
from touchline.coordination.coordination import Coordination
from touchline.coordination.dispatch.dispatch_memory import DispatchMemory
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.messages.team_messages import TeamCell
from touchline.schemas.spec import Spec, parse
from touchline.schemas.team import GoalsTask, TaskSpec, TeamScenario
from touchline.schemas.user_folders import state_folder

_SAME_M: Final = 1e-6


class TeamMemory(Spec):
    """Memory of a coordinator.

    Attributes:
        team: The team, with what is left of its task.
        robots: Robots that have cells or plans; empty before the team has begun.
        tasks: Tasks of its dispatcher, if it has one.
    """

    team: TeamScenario
    robots: tuple[str, ...] = ()
    tasks: DispatchMemory | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Robots to be guided: others may have joined the team since it began, or been removed."""
        return self.robots or self.team.names


class MemoryKeeper:
    """Keeper of a coordinator's memory.

    Args:
        bus: Bus of the team's namespace.
        coordination: The coordinator.
    """

    def __init__(self, bus: Bus, coordination: Coordination) -> None:
        self._publisher, self._coordination = bus.publisher(topics.TEAM_MEMORY), coordination
        self._file, self._text = journal_path(bus.namespace), ""
        self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)

    def keep(self, team: TeamScenario) -> None:
        """Publish and write down what has changed.

        Args:
            team: The team with its present task.
        """
        coordination = self._coordination
        left = remaining_task(team.task, coordination.cells())
        robots = coordination.hub.names if coordination.hub is not None else ()
        told = team.model_copy(update={"task": left})
        memory = TeamMemory(team=told, robots=robots, tasks=coordination.dispatch_memory)
        text = memory.model_dump_json()
        if text == self._text:
            return
        self._text = text
        self._publisher.send(m.String(data=text))
        new = self._file.with_suffix(".new")
        new.write_text(text)
        new.replace(self._file)


def journal_path(namespace: str) -> Path:
    """Return the path of a team's journal, in the user's folder."""
    return state_folder() / f"{namespace}.team.json"


def read_journal(file: Path, team: TeamScenario) -> TeamMemory:
    """Return the memory in a journal; of another team, or without any, only the team.

    Args:
        file: The journal.
        team: The team.
    """
    with suppress(OSError, SpecError):
        memory = parse(TeamMemory, file.read_text(), file.name)
        if memory.team.names == team.names:
            return memory
    return TeamMemory(team=team)


def remaining_task(task: TaskSpec, cells: list[TeamCell]) -> TaskSpec:
    """Return what is left of a task: robots that change places, or drive to goals in turn, go on to their last goals.

    Args:
        task: The task.
        cells: Where its robots drive.
    """
    goals = {cell.name: (cell.goal_x_m, cell.goal_y_m) for cell in cells}
    if not goals or task.kind not in ("swap", "goals"):
        return task
    given = task.goals if isinstance(task, GoalsTask) else {}
    left = {name: _from(goal, given.get(name, ())) for name, goal in goals.items()}
    return GoalsTask(kind="goals", goals=left)


def _from(goal: tuple[float, float], given: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Return goals from a present one on."""
    for number, (x_m, y_m) in enumerate(given):
        if abs(x_m - goal[0]) + abs(y_m - goal[1]) < _SAME_M:
            return given[number:]
    return (goal,)
