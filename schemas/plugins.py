"""Registries of plug-ins: drives, tools, sensors, faults, methods of plans, speed laws and followers.

A plug-in has a name, by which options ask for it, a summary for people, and what makes it. Those that are shipped are
registered by `touchline.shipped_plugins` with where they are found, so that the command line and the console can list
them without importing them.
Those of other packages are entry points that name a `Plugin` each; a registry looks for them when it is first asked for
more than what is shipped (see docs/guides/plugins.md).
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Generic, TypeVar

from touchline.schemas.entry_points import Offer, leave_out, offers
from touchline.schemas.errors import SpecError, TouchlineError

T = TypeVar("T")
U = TypeVar("U")
_LOG = logging.getLogger(__name__)
#: What options and help texts can hold.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


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
    """The object at ``"package.module:name"``, imported if need be; anything but a string is returned as it is."""
    if not isinstance(made, str):
        return made
    module, _, name = made.partition(":")
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class KindParts:
    """A kind of drive, tool, sensor or fault: a class in each room that has to know it, or where that is found.

    Attributes:
        spec: What a file says of it: a `DriveSpec`, `ToolSpec` or `SensorSpec` of schemas/vehicles, a `Fault` of
            schemas/faults.py.
        planner: What plans keep to: a `PlannedDrive` of services/planner/drives. Only drives have one.
        onboard: What the robot's computer asks: an `OnboardDrive` of onboard/drives, an `OnboardSensor` of
            onboard/estimation. Tools and faults have none, nor have sensors that it does not use.
        world: How it is emulated: a `WorldDrive` or `WorldTool` of services/robot_sim/world, a `WorldSensor` of
            services/robot_sim/sensors; of a fault the function that applies it, an `ApplyFault` of
            services/robot_sim/fault_effects/acting.py.
        truth: What a scenario says of sensors of this kind: a `SensorTruth` of schemas. Only sensors have one.
    """

    spec: Any
    planner: Any = None
    onboard: Any = None
    world: Any = None
    truth: Any = None

    def part(self, room: str) -> Any:
        """The class for one room, by the attribute's name."""
        return located(getattr(self, room))


class BrokenPlugin(TouchlineError):
    """Error: the object that makes a plug-in of another package cannot be imported."""


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """One entry of a registry.

    Attributes:
        summary: One line for people.
        make: What makes it, or where that is found: ``"package.module:name"``.
        empty: What options that are left empty mean with it, by the option's name, as dialogs show it.
        covering: Whether it is only for tools that work wherever they pass.
    """

    summary: str
    make: T | str
    empty: Mapping[str, str] = field(default_factory=dict)
    covering: bool = False

    def found(self) -> T:
        """The class or function that makes it, imported if need be."""
        made: T = located(self.make)
        return made


def listed(names: Iterable[str]) -> str:
    """Return names, one or more, in words: ``'a', 'b' or 'c'``."""
    *others, last = map(repr, names)
    return f"{', '.join(others)} or {last}" if others else last


class Registry(Generic[T]):
    """The plug-ins of one kind by name, in the order in which they were registered; the first is the default.

    Attributes:
        kind: What people call one of them: ``"area method"``.
        group: Of the entry points by which other packages offer theirs: ``"touchline.area_methods"``.
    """

    def __init__(self, kind: str) -> None:
        """`kind` is what people call one of them."""
        self.kind = kind
        self.group = f"touchline.{kind.replace(' ', '_')}s"
        self._plugins: dict[str, Plugin[T]] = {}
        self._packages: dict[str, str] = {}
        self._shipped: frozenset[str] = frozenset()
        self._looked = False

    def close_shipped(self) -> None:
        """Take what is registered so far for what comes with Touchline."""
        self._shipped = frozenset(self._plugins)

    def register(
        self,
        name: str,
        summary: str,
        make: T | str,
        empty: Mapping[str, str] | None = None,
        *,
        covering: bool = False,
    ) -> None:
        """Add a plug-in.

        Args:
            name: By which it is asked for.
            summary: One line for people: help texts and dialogs show it.
            make: What makes it, or ``"package.module:name"``, which is imported when it is first needed.
            empty: What options that are left empty mean with it, by the option's name; those that are not named mean
                what the vehicle says.
            covering: Whether it is only for tools that work wherever they pass.

        Raises:
            ValueError: There is one of that name.
        """
        if name in self._plugins:
            raise ValueError(f'there is a {self.kind} "{name}" already')
        self._plugins[name] = Plugin(summary, make, empty or {}, covering)

    def forget(self, name: str) -> None:
        """Take a plug-in out again."""
        del self._plugins[name]

    def _all(self) -> dict[str, Plugin[T]]:
        """All plug-ins; the first time, those of other packages are looked for."""
        if not self._looked:
            self._looked = True
            for offer in offers(self.group):
                if problem := self._take(offer):
                    leave_out(self.kind, offer, problem)
        return self._plugins

    def _take(self, offer: Offer) -> str:
        """Add what another package offers; what is wrong with it, or nothing."""
        if not _NAME.fullmatch(offer.name):
            return "its name must be of letters, digits, dots, dashes and underscores"
        if offer.name in self._plugins:
            return f"there is a {self.kind} of that name already; rename it, or uninstall one of both"
        try:
            found = offer.load()
        except (Exception, SystemExit) as error:  # noqa: BLE001, whatever somebody else's module does on import
            return f"importing it fails with {type(error).__name__}: {error}; mend or uninstall the package"
        if not isinstance(found, Plugin):
            return f"its entry point names a {type(found).__name__}, not a touchline.schemas.plugins.Plugin"
        self._plugins[offer.name], self._packages[offer.name] = found, offer.package
        return ""

    def is_shipped(self, name: str) -> bool:
        """True if the plug-in of that name comes with Touchline."""
        return name in self._shipped

    def described(self, name: str) -> str:
        """The plug-in of that name for people, with the package that it is from."""
        package = self._packages.get(name)
        return f'the {self.kind} "{name}"' + (f" of the package {package}" if package else "")

    def summary(self, name: str) -> str:
        """The line for people about the plug-in of that name.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
        """
        return self._plugins[self.known(name)].summary

    def number(self, name: str) -> int:
        """Its place in the order of registration, from 0.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
        """
        return list(self._plugins).index(self.known(name))

    @property
    def default(self) -> str:
        """Name of the plug-in used when none is named."""
        return next(iter(self._plugins))

    def names(self) -> tuple[str, ...]:
        """All names."""
        return tuple(self._all())

    def offered(self) -> tuple[str, ...]:
        """All names but those of what is built in and has nothing to be made; imports none."""
        return tuple(name for name, plugin in self._all().items() if plugin.make is not None)

    def summaries(self) -> dict[str, str]:
        """Summary by name."""
        return {name: plugin.summary for name, plugin in self._all().items()}

    def summaries_for(self, *, covers: bool) -> dict[str, str]:
        """Those of the plug-ins for a tool that covers, its own first, or for one that does not; the default first."""
        own = {name: plugin.summary for name, plugin in self._all().items() if plugin.covering}
        rest = {name: summary for name, summary in self.summaries().items() if name not in own}
        return {**own, **rest} if covers else rest

    def empty(self, name: str, option: str) -> str | None:
        """Meaning of an option that is left empty, with the plug-in of that name; None: the vehicle's value."""
        return self._plugins[self.known(name)].empty.get(option)

    @property
    def advice(self) -> str:
        """Remedy for an unknown name: ``give 'a', 'b' or 'c'``."""
        return f"give {self.listed}"

    @property
    def listed(self) -> str:
        """All names in words: ``'a', 'b' or 'c'``."""
        return listed(self._all())

    def has(self, name: str) -> bool:
        """True if there is one of that name; only for names that are not shipped other packages are looked at."""
        return name in self._plugins or name in self._all()

    def known(self, name: str) -> str:
        """The name itself.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
        """
        if not self.has(name):
            raise UnknownPlugin(self.kind, name, self.advice)
        return name

    def find(self, name: str) -> T:
        """The class or function that makes the plug-in of that name.

        Raises:
            UnknownPlugin: Nothing of that name is registered.
            BrokenPlugin: It is of another package, which fails to import it.
        """
        return self.imported(name, self._plugins[self.known(name)].found)

    def imported(self, name: str, found: Callable[[], U]) -> U:
        """Object that `found` imports of the plug-in of that name.

        Raises:
            BrokenPlugin: It is of another package, which fails to import it.
        """
        if name not in self._packages:
            return found()
        try:
            return found()
        except Exception as error:  # whatever somebody else's module does on import
            problem = f'importing the {self.kind} "{name}" of the package {self._packages[name]} fails'
            remedy = "mend or uninstall the package"
            raise BrokenPlugin(f"{problem} with {type(error).__name__}: {error}; {remedy}") from error


#: Set by `--verbose`, for this process and those that it starts.
VERBOSE = "TOUCHLINE_VERBOSE"


def log_plugin_error(problem: str) -> None:
    """Log the exception being handled, of a plug-in, with its traceback: with `--verbose` as a warning.

    Otherwise it is information, which log files of services have.
    """
    level = logging.WARNING if os.environ.get(VERBOSE) else logging.INFO
    _LOG.log(level, "%s", problem, exc_info=True)


def part_for(registry: Registry[Any], kind: str, room: str, source: str = "vehicle") -> Any:
    """The class that a kind has for one room, by the attribute's name of `KindParts`; `source` is what has named it.

    Raises:
        SpecError: It has none.
        UnknownPlugin: Nothing of that name is registered.
        BrokenPlugin: It is of another package, which fails to import it.
    """
    parts = registry.find(kind)
    if getattr(parts, room) is None:
        others = [name for name in registry.names() if getattr(registry.find(name), room) is not None]
        remedy = f"give one that has ({', '.join(others)}), or register its part `{room}` in `KindParts`"
        raise SpecError(source, f"{registry.kind}.kind", f"is {kind!r}, which has nothing for the {room}", remedy)
    return registry.imported(kind, lambda: parts.part(room))


DRIVES: Registry[KindParts] = Registry("drive")
"""Drives, by the `kind` of a vehicle's `drive`."""
TOOLS: Registry[KindParts] = Registry("tool")
"""Tools, by the `kind` of a vehicle's `tool`."""
FAULTS: Registry[KindParts] = Registry("fault")
"""Faults of a robot, by their `kind`."""
SENSORS: Registry[KindParts | None] = Registry("sensor")
"""Sensors. Those that are part of every robot have no parts; the others are auxiliary ones, by the `kind` of each of a
vehicle's `sensors`. `number` is where kernels have what faults do to the messages of one of them."""
METHODS: Registry[Any] = Registry("transition method")
"""Transition methods: a `Method` of services/planner/transitions/method_choice.py each."""
AREA_METHODS: Registry[Any] = Registry("area method")
"""Area methods: an `AreaMethod` or `CoverageMethod` of services/planner/coverage/area_method.py each."""
FOLLOWERS: Registry[Any] = Registry("follower")
"""Steering along the path: each a function from `Vehicle` and `Ask` to a `Follower` of onboard/control."""
EXTERNAL = "external"
"""The follower that is asked over the bus."""
EXTERNAL_TIMED = "external-timed"
"""And the same with a reference that keeps the plan's time."""
ASKED = (EXTERNAL, EXTERNAL_TIMED)
TEAM_ALGORITHMS: Registry[Any] = Registry("team algorithm")
"""Algorithms of teams: what makes a `TeamAlgorithm` or `RobotAlgorithm` of coordination/algorithms each."""
POSE_METHODS: Registry[Any] = Registry("pose method")
"""Pose methods: a `PoseMethod` of services/planner/poses each."""
SPEED_LAWS: Registry[Any] = Registry("speed law")
"""Speed laws between two poses: a `SpeedLaw` of services/planner/poses/speed_laws.py each; None: by the limits."""
