"""Robots as a process: it serves commands, keeps the pace, and monitors their links; a process of its own publishes.

The loop waits for nobody. Stops, of all its robots, are checked before everything else and after every few ticks; long
work is done in other threads (`loading`) and processes (`outbox`); of everything else a limited amount is served in a
turn. Robots share the loop and nothing else: each has its own emulator, pace, journal and handlers, so that its bytes
are the same alone and beside others.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.schemas import topics
from touchline.schemas.setup import Setup
from touchline.schemas.user_folders import state_folder
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.outbox import Outbox, RobotOutlet
from touchline.services.robot_sim.robot_host import RobotHost
from touchline.services.robot_sim.robot_process import ClockPolicy, RobotProcess
from touchline.services.robot_sim.together import check_together
from touchline.services.robot_sim.warm_up import warm_up
from touchline.supervision.late_compilations import LateCompilations
from touchline.supervision.priority import FIRST, run_at, switch_threads_soon
from touchline.supervision.shutdown import until_stopped

PATIENCE_S: Final = 0.2
"""Time after which a client that does not take its answer is cut off; less would cut off honest ones on a busy
machine."""


def run_service(
    robots: Mapping[str, Setup],
    config: BusConfig | None = None,
    *,
    speed: float = 1.0,
    clock: ClockPolicy = "held",
    journal: Path | None = None,
    supervisor: int | None = None,
) -> None:
    """Run these robots until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        robots: Setups by namespace, each with its computer and its world.
        config: Configuration of the bus.
        speed: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as possible.
        clock: `held`: sim time passes only while a traversal is under way or coming to rest, so that runs are
            reproducible; `free`: always.
        journal: Journal from which another process could continue: a file, or a folder with one for each robot;
            default: in the user's state folder.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration cannot be used, or these robots cannot share a process.
        TouchlineError: One of them runs already.
    """
    check_together(robots, journal)
    config = (config or BusConfig.from_environment()).of(*robots)
    switch_threads_soon()
    run_at(FIRST)
    with (
        until_stopped(supervisor) as stop,
        Bus.open_all(topics.ROBOT_SIM, config, lambda: stop.asked, PATIENCE_S) as buses,
    ):
        buses[0].open_door()
        outbox = Outbox(config)
        try:
            health = [HealthReporter(bus) for bus in buses]
            _warm_up(robots.values(), health)
            late = LateCompilations(stop)
            for bus, reporter in zip(buses, health, strict=True):
                bus.claim()
                reporter.common = late.values
            late.watch()
            gc.freeze()
            gc.disable()
            with ExitStack() as journals:
                host = RobotHost(
                    [
                        RobotProcess(
                            bus,
                            health[number],
                            setup,
                            RobotOutlet(outbox, bus, number),
                            speed=speed,
                            clock=clock,
                            journal=journals.enter_context(Journal(journal_path(bus.namespace, journal))),
                        )
                        for number, (bus, setup) in enumerate(zip(buses, robots.values(), strict=True))
                    ]
                )
                while not stop:
                    host.turn()
                host.close()
        finally:
            outbox.close()


def _warm_up(setups: Iterable[Setup], health: Sequence[HealthReporter]) -> None:
    """Compile the kernels of these robots; robots that differ only in their worlds need the same ones."""

    def report(doing: str) -> None:
        for reporter in health:
            reporter.starting(doing)

    done: list[tuple[object, object]] = []
    for setup in setups:
        kind = setup.vehicle, setup.onboard
        if kind not in done:
            done.append(kind)
            warm_up(report, setup, in_team=True)


def journal_path(namespace: str, chosen: Path | None = None) -> Path:
    """Return the path of a robot's journal.

    Args:
        namespace: Namespace of the robot.
        chosen: File or folder chosen by the user; None: the user's state folder.
    """
    if chosen is not None:
        return chosen / f"{namespace}.journal" if chosen.is_dir() else chosen
    return state_folder() / f"{namespace}.journal"
