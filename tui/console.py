"""Run the console on the bus."""

from __future__ import annotations

from schemas import topics
from schemas.messages.touchline import TraversalReport
from tui.app import ConsoleApp
from tui.autostart import AutoStart
from tui.link import BusConfig, open_link


def run_console(
    config: BusConfig | None = None,
    *,
    template: str | None = None,
    auto_start: bool = False,
    speed: float | None = None,
) -> TraversalReport | None:
    """Open the console and return when the operator leaves it, with the figures of the last finished job if any.

    Args:
        config: How to join the bus; the environment's by default.
        template: Shipped name or file to show on opening.
        auto_start: Also plan the template, load it and start, as soon as the services are there.
        speed: Speed factor to set on opening; negative is as fast as it goes.
    """
    with open_link(config, topics.CONSOLE) as link:
        app = ConsoleApp(link, AutoStart(template, speed, auto_start))
        app.run()
        return app.state.robot.report
