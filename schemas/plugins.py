"""What can be plugged in: transition methods, area methods and followers, one registry for each kind, read by all.

A plug-in has a name, by which options ask for it, a summary for people, and what makes it. Those that are shipped are
registered here by where they are found, so that the command line and the console can list them without importing them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """One entry of a registry.

    Attributes:
        summary: One line for people.
        make: What makes it, or where that is found: ``"package.module:name"``.
        empty: What options that are left empty mean with it, by the option's name, as dialogs show it.
    """

    summary: str
    make: T | str
    empty: Mapping[str, str] = field(default_factory=dict)

    def found(self) -> T:
        """What makes it, imported if need be."""
        if not isinstance(self.make, str):
            return self.make
        module, _, name = self.make.partition(":")
        made: T = getattr(import_module(module), name)
        return made


class Registry(Generic[T]):
    """The plug-ins of one kind by name, in the order in which they were registered; the first is the default."""

    def __init__(self, kind: str) -> None:
        """`kind` is what people call one of them."""
        self.kind = kind
        self._plugins: dict[str, Plugin[T]] = {}

    def register(self, name: str, summary: str, make: T | str, empty: Mapping[str, str] | None = None) -> None:
        """Add a plug-in.

        Args:
            name: By which it is asked for.
            summary: One line for people: help texts and dialogs show it.
            make: What makes it, or ``"package.module:name"``, which is imported when it is first needed.
            empty: What options that are left empty mean with it, by the option's name; those that are not named mean
                what the vehicle says.

        Raises:
            ValueError: There is one of that name.
        """
        if name in self._plugins:
            raise ValueError(f'there is a {self.kind} "{name}" already')
        self._plugins[name] = Plugin(summary, make, empty or {})

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

    def empty(self, name: str, option: str) -> str | None:
        """What an option that is left empty means with the plug-in of that name; None: what the vehicle says."""
        return self._plugins[self.known(name)].empty.get(option)

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


_METHODS = "touchline.services.planner.transitions.methods"
_COVERAGE = "touchline.services.planner.coverage"
_FOLLOWERS = "touchline.services.onboard.control"

METHODS: Registry[Any] = Registry("transition method")
"""How painted lines are joined: a `Method` of services/planner/method_choice.py each."""
METHODS.register(
    "g2",
    "quickest: turns by the wheels' limits, reversing too",
    f"{_METHODS}:G2",
    empty={"kappa_max_1pm": "by the wheels", "sigma_max_1pm2": "by the wheels"},
)
METHODS.register("ccd", "smooth: one kind of curvature-continuous turn", f"{_METHODS}:CCD")
METHODS.register("dubins-padded", "baseline: plain arcs with padding", f"{_METHODS}:DUBINS_PADDED")

AREA_METHODS: Registry[Any] = Registry("area method")
"""How areas are covered: an `AreaMethod` of services/planner/coverage/area_method.py each."""
AREA_METHODS.register("parallel", "straight swaths side by side", f"{_COVERAGE}.parallel:parallel")

FOLLOWERS: Registry[Any] = Registry("follower")
"""What steers the robot along its path: from `Vehicle` and `Ask` to a `Follower` of services/onboard/control each."""
EXTERNAL = "external"
"""The follower that is asked over the bus."""
FOLLOWERS.register("mpc", "model predictive control of the nozzle", f"{_FOLLOWERS}:make_mpc")
FOLLOWERS.register("pure-pursuit", "pursuit of a point ahead, with less computing", f"{_FOLLOWERS}:make_pure_pursuit")
FOLLOWERS.register(EXTERNAL, "your own program, asked over the bus", f"{_FOLLOWERS}:ExternalFollower")
