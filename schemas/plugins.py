"""What can be plugged in: drives, tools, transition methods and followers, in one registry each that every part reads.

A plug-in has a name, by which options ask for it, a summary for people, and what makes it. Those that are shipped are
registered here by where they are found, so that the command line and the console can list them without importing them.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class UnknownPlugin(ValueError):
    """Nothing of that name is registered; the text says what is.

    Args:
        kind: What was asked for: ``"follower"``.
        name: By which it was asked for.
        remedy: The known names, as advice.
    """

    def __init__(self, kind: str, name: str, remedy: str) -> None:
        self.kind, self.name, self.remedy = kind, name, remedy
        super().__init__(f'there is no {kind} "{name}"; {remedy}')


def located(made: Any) -> Any:
    """What is found under ``"package.module:name"``, imported if need be; anything but a text is itself."""
    if not isinstance(made, str):
        return made
    module, _, name = made.partition(":")
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class KindParts:
    """A kind of drive or tool: a class in each room that has to know it, or where that is found.

    Attributes:
        spec: What a vehicle's file says of it: a `DriveSpec` or `ToolSpec` of schemas/vehicles.
        planner: What plans keep to: a `PlannedDrive` of services/planner/drives. Tools have none.
    """

    spec: Any
    planner: Any = None

    def part(self, room: str) -> Any:
        """The class for one room, by the attribute's name."""
        return located(getattr(self, room))


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """One entry of a registry.

    Attributes:
        summary: One line for people.
        make: What makes it, or where that is found: ``"package.module:name"``.
    """

    summary: str
    make: T | str

    def found(self) -> T:
        """What makes it, imported if need be."""
        made: T = located(self.make)
        return made


class Registry(Generic[T]):
    """The plug-ins of one kind by name, in the order in which they were registered; the first is the default."""

    def __init__(self, kind: str) -> None:
        """`kind` is what people call one of them."""
        self.kind = kind
        self._plugins: dict[str, Plugin[T]] = {}

    def register(self, name: str, summary: str, make: T | str) -> None:
        """Add a plug-in.

        Args:
            name: By which it is asked for.
            summary: One line for people: help texts and dialogs show it.
            make: What makes it, or ``"package.module:name"``, which is imported when it is first needed.

        Raises:
            ValueError: There is one of that name.
        """
        if name in self._plugins:
            raise ValueError(f'there is a {self.kind} "{name}" already')
        self._plugins[name] = Plugin(summary, make)

    def forget(self, name: str) -> None:
        """Take a plug-in out again."""
        del self._plugins[name]

    @property
    def default(self) -> str:
        """The name of the one that is meant if none is named."""
        return next(iter(self._plugins))

    def names(self) -> tuple[str, ...]:
        """All names."""
        return tuple(self._plugins)

    def summaries(self) -> dict[str, str]:
        """Summary by name."""
        return {name: plugin.summary for name, plugin in self._plugins.items()}

    @property
    def advice(self) -> str:
        """What to give instead of an unknown name: ``give 'a', 'b' or 'c'``."""
        *others, last = map(repr, self._plugins)
        return f"give {', '.join(others)} or {last}" if others else f"give {last}"

    def known(self, name: str) -> str:
        """The name itself.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
        """
        if name not in self._plugins:
            raise UnknownPlugin(self.kind, name, self.advice)
        return name

    def find(self, name: str) -> T:
        """What makes the plug-in of that name.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
        """
        return self._plugins[self.known(name)].found()


_VEHICLES = "touchline.schemas.vehicles"
_DRIVES = "touchline.services.planner.drives"
_METHODS = "touchline.services.planner.transitions.methods"
_FOLLOWERS = "touchline.services.onboard.control"

DRIVES: Registry[KindParts] = Registry("drive")
"""What moves a vehicle, by the `kind` of its `drive`."""
DRIVES.register(
    "differential",
    "two driven wheels on one axle, and casters",
    KindParts(f"{_VEHICLES}:DifferentialDrive", f"{_DRIVES}.differential_caps:PlannedDifferential"),
)

TOOLS: Registry[KindParts] = Registry("tool")
"""What a vehicle works with, by the `kind` of its `tool`."""
TOOLS.register(
    "sprayer", "a nozzle that paints lines, with valve, discs and tank", KindParts(f"{_VEHICLES}:SprayerTool")
)

METHODS: Registry[Any] = Registry("transition method")
"""How painted lines are joined: a `Method` of services/planner/method_choice.py each."""
METHODS.register("g2", "quickest: turns by the wheels' limits, reversing too", f"{_METHODS}:G2")
METHODS.register("ccd", "smooth: one kind of curvature-continuous turn", f"{_METHODS}:CCD")
METHODS.register("dubins-padded", "baseline: plain arcs with padding", f"{_METHODS}:DUBINS_PADDED")

FOLLOWERS: Registry[Any] = Registry("follower")
"""What steers the robot along its path: from `Vehicle` and `Ask` to a `Follower` of services/onboard/control each."""
EXTERNAL = "external"
"""The follower that is asked over the bus."""
FOLLOWERS.register("mpc", "model predictive control of the nozzle", f"{_FOLLOWERS}:make_mpc")
FOLLOWERS.register("pure-pursuit", "pursuit of a point ahead, with less computing", f"{_FOLLOWERS}:make_pure_pursuit")
FOLLOWERS.register(EXTERNAL, "your own program, asked over the bus", f"{_FOLLOWERS}:ExternalFollower")
