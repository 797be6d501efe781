"""Entry point of the console on the bus."""

from __future__ import annotations

import gc
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TextIO

from textual.app import App

from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.touchline import TraversalReport
from touchline.schemas.plugins import AREA_METHODS, METHODS, POSE_METHODS, SPEED_LAWS
from touchline.schemas.roles import Role
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.link import BusConfig, open_links

ENDS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def _node(config: BusConfig) -> str:
    """Return the console's name on the bus: for robots, whoever may not command them is no operator at a console."""
    operates = config.identity is None or config.identity.role is Role.OPERATOR
    return topics.CONSOLE if operates else topics.OBSERVER


def run_console(
    config: BusConfig | None = None,
    *,
    everyone: bool = False,
    template: str | None = None,
    auto_start: bool = False,
    speed: float | None = None,
) -> TraversalReport | None:
    """Open the console until the operator leaves it; return the report of the last finished job, if any.

    Args:
        config: Bus configuration with the initial robots; the environment's by default.
        everyone: Whether robots that appear later are added.
        template: Shipped name or file to show on opening.
        auto_start: Whether to plan, load and start the template as soon as the services are there.
        speed: Speed factor to set on opening; negative is as fast as possible.

    Raises:
        TouchlineError: The terminal's encoding is not UTF-8, or the console broke down.
        SystemExit: A signal ended it, or its terminal is gone.
    """
    check_encoding(sys.__stdout__)
    for registry in (METHODS, AREA_METHODS, POSE_METHODS, SPEED_LAWS):
        registry.names()  # reports broken plug-ins of packages while standard error is visible
    config = config or BusConfig.from_environment()
    with open_links(config, _node(config), everyone=everyone) as links:
        app = ConsoleApp(links, AutoStart(template, speed, auto_start))
        gc.freeze()  # collecting all loaded objects would delay the emergency stop
        with ended_by_signals(app):
            app.run()
    check_end(app)
    return app.state.robot.report


def check_encoding(terminal: TextIO | None) -> None:
    """Refuse a terminal that cannot show the map and the marks.

    Raises:
        TouchlineError: The encoding is not UTF-8.
    """
    encoding = getattr(terminal, "encoding", None) or "unknown"
    if encoding.lower().replace("-", "") != "utf8":
        raise TouchlineError(
            f"the console needs a UTF-8 terminal, and the locale says {encoding}; set LC_ALL=C.UTF-8, or use "
            "`touchline run` and `touchline status`"
        )


@contextmanager
def ended_by_signals(app: App[None]) -> Iterator[None]:
    """Context in which ending signals close the console properly, so that the terminal stays usable."""

    def end(number: int, frame: FrameType | None) -> None:
        app.call_later(app.exit, return_code=128 + number)

    heard = [number for number in ENDS if signal.getsignal(number) is not signal.SIG_IGN]  # as under nohup
    before = {number: signal.signal(number, end) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check_end(app: ConsoleApp) -> None:
    """Raise the errors of `run_console`, unless the operator has left normally."""
    if app.return_code == 0:
        return
    if app.return_code is not None and app.return_code > 128:
        raise SystemExit(app.return_code)
    error, place = app.breakdown, ""
    if error is not None and (frames := traceback.extract_tb(error.__traceback__)):
        place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})"
    what = f"{type(error).__name__}: {error}{place}" if error is not None else "its input failed"
    remedy = "the robot goes on without it, open another with `touchline tui`"
    raise TouchlineError(f"the console broke down: {' '.join(what.split())}; {remedy}") from error
