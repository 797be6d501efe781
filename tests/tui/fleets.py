"""Consoles with many robots, each on a fake link, in every state."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from textual.pilot import Pilot

from tests.tui import scenes
from tests.tui.console import laid_out
from tests.tui.scenes import FakeLink, FakeLinks, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.tui.app import ConsoleApp
from touchline.tui.fleet_screen import FleetScreen
from touchline.tui.state import ConsoleState

S = m.TraversalStatus
ROUND = (S.RUNNING, S.RUNNING, S.PAUSED, S.READY, S.ESTOPPED)
"""States of the robots, one after another."""


def robot(number: int, state: int) -> FakeLink:
    """In rows of ten, 12 m apart."""
    reason = "paused by the operator" if state == S.PAUSED else ""
    told = S(state=state, coverage_pct=float(number), painted_ids=("a",), speed_mps=0.5, reason=reason)
    place = scenes.odometry(12.0 * (number % 10), 9.0 * (number // 10), 0.7 * number)
    link = FakeLink(incoming=[*scenes.up(), received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM))])
    link.incoming += [received(topics.STATUS, told), received(topics.ODOMETRY, place)]
    if state == S.PAUSED:
        link.incoming.append(received(topics.PAUSE_STATUS, m.PauseStatus(cause=m.PauseStatus.OPERATOR)))
    link.incoming += scenes.robot_health(battery=0.9 - 0.01 * (number % 50))
    return link


def fleet(count: int, *states: int) -> dict[str, FakeLink]:
    """Robots r01, r02 and so on, in these states by turns."""
    turns = states or ROUND
    return {f"r{number + 1:02}": robot(number, turns[number % len(turns)]) for number in range(count)}


@dataclass
class Scene:
    """A console with its fleet, and a clock that a test advances."""

    app: ConsoleApp
    links: dict[str, FakeLink]
    known: FakeLinks
    pilot: Pilot[None]
    now: list[float]

    @property
    def screen(self) -> FleetScreen:
        screen = self.app.fleet_screen
        assert screen is not None
        return screen

    async def tick(self, seconds: float = 0.0, *, silent: tuple[str, ...] | None = None) -> None:
        """Time passes, and everybody but those that are silent goes on talking (all are, if that is not given)."""
        while seconds > 0.0:
            step = min(seconds, 0.2)
            seconds -= step
            self.now[0] += step
            for name, link in self.links.items():
                if silent is not None and name not in silent:
                    link.incoming.append(received(topics.CLOCK, m.Clock(clock=m.Time(sec=1))))
            self.app.tick()
        self.app.tick()
        await laid_out(self.pilot)

    def text(self) -> str:
        """All that is on the screen."""
        strips = self.app.screen._compositor.render_strips()
        return "\n".join("".join(segment.text for segment in strip) for strip in strips)

    def state(self, name: str) -> ConsoleState:
        return self.app.robots.states[name]


@asynccontextmanager
async def fleet_console(
    links: dict[str, FakeLink], *keys: str, size: tuple[int, int] = (80, 24)
) -> AsyncIterator[Scene]:
    """With these keys pressed."""
    now = [1.0]
    known = FakeLinks(links)
    app = ConsoleApp(known, clock=lambda: now[0])
    async with app.run_test(size=size) as pilot:
        scene = Scene(app, links, known, pilot, now)
        await scene.tick()
        await pilot.press(*keys)
        await scene.tick()
        yield scene


def asked(link: FakeLink) -> list[str]:
    """The services that were asked, each once."""
    return list(dict.fromkeys(name for name, _ in (*link.posted, *link.asked)))
