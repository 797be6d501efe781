"""Runs of a team, simulated or over the bus, for the commands that give it something to do."""

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from touchline.cli.display import progress_bar, say
from touchline.cli.garbage import without_collecting
from touchline.cli.job_bus import job_bus
from touchline.cli.job_terminal import Terminal, watch_system
from touchline.cli.options import speed_factor
from touchline.schemas import topics
from touchline.schemas.roles import Role
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TeamScenario
from touchline.schemas.topics import TEAM_NAMESPACE


def simulated(chosen: TeamScenario, *, hashed: bool, record: Path | None) -> dict[str, Any]:
    """Simulate a team; return its figures."""
    from touchline.coordination.algorithms.algorithm_loading import check_algorithm
    from touchline.core.stopwatch import Stopwatch
    from touchline.jobs.recording.payload_recorder import PayloadRecorder
    from touchline.jobs.task_pool import cores
    from touchline.jobs.team.team_figures import team_figures
    from touchline.jobs.team.team_run import TeamRun

    if chosen.algorithm is not None:  # before kernels are loaded
        check_algorithm(chosen.algorithm)
    with progress_bar("Team") as advance:
        watch = Stopwatch()
        with PayloadRecorder(record, (*chosen.names, TEAM_NAMESPACE)) as recorder, without_collecting():
            listener = recorder.hear if record is not None else None
            run = TeamRun(chosen, hashed=hashed, listener=listener, threads=cores())
            run.run(advance)
        return team_figures(run, watch.elapsed_s) | recorder.as_figure()


def run_on_bus(chosen: TeamScenario, speed: str, *, apart: bool, record: Path | None, secure: bool) -> dict[str, Any]:
    """Run a team over Zenoh in lockstep; return its figures.

    Raises:
        SpecError: The team, or a place of its task, cannot be used.
    """
    from touchline.bus.secured_check import check_secured
    from touchline.coordination.algorithms.algorithm_loading import check_algorithm
    from touchline.coordination.dispatch.dispatched_task import DispatchedTask
    from touchline.coordination.start_poses import free_area, start_poses
    from touchline.jobs.team.team_on_bus import TeamOnBus
    from touchline.supervision.running_system import only_one
    from touchline.supervision.secured_system import system_identities
    from touchline.supervision.temporary_system import ProcessOptions, local_system

    area = free_area(chosen)
    places = start_poses(chosen, area)
    if chosen.algorithm is not None:  # refuses now what the coordinator would
        check_algorithm(chosen.algorithm)
    if isinstance(chosen.task, DispatchTask):
        DispatchedTask(chosen.task, chosen, area, {name: (at.x_m, at.y_m) for name, at in places.items()})
    setups = {name: chosen.setup(name, places[name]) for name in chosen.names}
    config = job_bus(list(setups), secure=secure)
    identities = system_identities(list(setups)) if secure else {}
    with tempfile.TemporaryDirectory(prefix="touchline-") as folder, progress_bar("Team") as advance:
        file = Path(folder) / "team.json"
        file.write_text(chosen.model_dump_json(), encoding="utf-8")
        options = ProcessOptions(
            apart=apart,
            without=(topics.PLANNER,) if record else (topics.PLANNER, topics.BRIDGE),
            recordings=record.parent if record else None,
            coordinator=["--team", str(file), "--lockstep"],
            identities=identities,
        )
        with only_one(config), local_system(setups, config, options) as system:
            advance(0.0, "Starting")
            system.wait_until_ready(say)
            if secure:
                check_secured(system.bus.config.of(*setups), identities[Role.OBSERVER])
            buses = {bus.namespace: bus for bus in system.buses}
            watcher = Terminal(advance, partial(watch_system, system))
            return TeamOnBus(buses, chosen, watcher, speed_factor(speed), record).run()
