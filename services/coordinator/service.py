"""The coordinator of a team as a process, and a standby that takes over when it is lost."""

from __future__ import annotations

import time
from functools import partial
from typing import Final

from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.coordination.algorithms.algorithm_loading import check_algorithm
from touchline.coordination.free_area import FreeArea
from touchline.coordination.start_poses import free_area
from touchline.core.compilations import run_steps
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.team import TeamScenario
from touchline.services.coordinator.standby import Standby
from touchline.services.coordinator.team_memory import TeamMemory, journal_path, read_journal
from touchline.services.coordinator.team_service import TeamService
from touchline.services.coordinator.warm_up_team import warm_up_team
from touchline.supervision.late_compilations import LateCompilations
from touchline.supervision.shutdown import Stop, until_stopped

IDLE_S: Final = 0.001
"""Wall-clock time between two polls of the bus."""
STANDBY_LOOK_S: Final = 0.02


def run_service(
    team: TeamScenario,
    config: BusConfig | None = None,
    *,
    lockstep: bool = False,
    standby: bool = False,
    supervisor: int | None = None,
) -> None:
    """Coordinate a team until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        team: The team; its robots are on the bus, by their names.
        config: Bus configuration; its namespace is the team's.
        lockstep: Whether the emulated robots' sim time waits for the coordinator.
        standby: Whether to wait until another coordinator is lost, and to take over then.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration, the area, or the team's avoidance or algorithm, cannot be used.
        TouchlineError: Another coordinator runs or has taken over, or a robot cannot be guided.
    """
    if team.by_plans and not lockstep:
        raise SpecError("team", "avoid", "needs robots of one clock by plans", "use cells, or start with --lockstep")
    if standby and team.avoid == "none" and not team.by_plans:
        raise SpecError("team", "avoid", "is none, which no standby can take over", "use plans or cells")
    if team.algorithm is not None:
        check_algorithm(team.algorithm)
    config = config or BusConfig.from_environment((topics.TEAM_NAMESPACE,))
    with until_stopped(supervisor) as stop:
        former = read_journal(journal_path(topics.TEAM_NAMESPACE), team) if standby else None
        alone = supervisor is not None
        while former is not None and not stop:
            with Bus.open(topics.STANDBY, config, lambda: stop.asked) as bus:
                former = _stand_by(bus, former, stop)
                if not stop:  # in this session: joining the bus again would take up to a second or two
                    bus.rename(topics.COORDINATOR)
                    _coordinate(bus, former.team, stop, former, lockstep=lockstep, alone=alone)
        if former is None:
            with Bus.open(topics.COORDINATOR, config, lambda: stop.asked) as bus:
                _coordinate(bus, team, stop, None, lockstep=lockstep, alone=alone)


def _coordinate(
    bus: Bus, team: TeamScenario, stop: Stop, former: TeamMemory | None, *, lockstep: bool, alone: bool
) -> None:
    """Coordinate a team until this process is to stop, or the coordinator that it was to replace is back.

    Raises:
        SpecError: The area cannot be used.
        TouchlineError: Another coordinator runs or has taken over, or a robot cannot be guided.
    """
    area = free_area(team)
    bus.claim()
    health = HealthReporter(bus)
    if former is None:
        _load(health, team, area)
    service = TeamService(bus, team, area, lockstep=lockstep, alone=alone, former=former)
    late = LateCompilations(stop)
    health.common = late.values
    late.watch()
    while not stop and not service.former_is_back:
        if not service.turn():
            time.sleep(IDLE_S)
        health.poll(service.figures, message=service.doing)


def _stand_by(bus: Bus, memory: TeamMemory, stop: Stop) -> TeamMemory:
    """Wait until the team's coordinator is lost, or this process is to stop; return the coordinator's memory.

    Everything that compiles is compiled before.
    """
    health = HealthReporter(bus)
    _load(health, memory.team, free_area(memory.team))
    watch = Standby(bus, memory)
    while not stop and not watch.turn():
        health.poll({}, message=watch.doing)
        time.sleep(STANDBY_LOOK_S)
    return watch.memory


def _load(health: HealthReporter, team: TeamScenario, area: FreeArea) -> None:
    """Compile and load what coordination needs."""
    health.starting("loading kernels")
    run_steps([("a team of two", partial(warm_up_team, team, area))], health.starting)
