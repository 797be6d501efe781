"""Robots as a process: it serves commands, keeps the pace, and minds their links; a process of its own publishes.

The loop waits for nobody. Stops, of all its robots, are looked for before everything else and after every few ticks;
what takes long is done in other threads (`loading`) and processes (`outbox`); of everything else a bounded amount is
served in a turn. Robots share the loop and nothing else: each has its own emulator, pace, journal and handlers, so that
its bytes are the same alone and beside others.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.schemas import topics
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.outbox import Outbox, RobotOutlet
from touchline.services.robot_sim.robot_process import ClockPolicy, RobotHost, RobotProcess
from touchline.services.robot_sim.together import check_together
from touchline.services.robot_sim.warm_up import warm_up
from touchline.supervision.late_compilations import LateCompilations
from touchline.supervision.priority import FIRST, run_at, switch_threads_soon
from touchline.supervision.shutdown import until_stopped

PATIENCE_S: Final = 0.2
"""A client that does not take its answer within this is cut off; less would cut off honest ones on a busy machine."""


def run_service(
    robots: Mapping[str, Setup],
    config: BusConfig | None = None,
    *,
    speed: float = 1.0,
    clock: ClockPolicy = "held",
    journal: Path | None = None,
    supervisor: int | None = None,
) -> None:
    """Be these robots until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        robots: By namespace, each with its computer and its world.
        config: Where the bus is.
        speed: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as it goes.
        clock: `held`: sim time passes only while a traversal is under way or coming to rest, so that runs are
            reproducible; `free`: always.
        journal: Where is kept what another process would go on from: a file, or a folder with one for each robot;
            default: in the user's state folder.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration cannot be used, or these robots cannot be of one process.
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
                            RobotOutlet(outbox, number),
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
    """Compile what these robots need; what differs in their worlds only needs nothing else."""

    def tell(doing: str) -> None:
        for reporter in health:
            reporter.starting(doing)

    done: list[tuple[object, object]] = []
    for setup in setups:
        kind = setup.vehicle, setup.onboard
        if kind not in done:
            done.append(kind)
            warm_up(tell, setup, in_team=True)


def journal_path(namespace: str, chosen: Path | None = None) -> Path:
    """Where the robot of this namespace keeps its journal: in a file or folder that was chosen, or the user's state."""
    if chosen is not None:
        return chosen / f"{namespace}.journal" if chosen.is_dir() else chosen
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local" / "state") / "touchline" / f"{namespace}.journal"
