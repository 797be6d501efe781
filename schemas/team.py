"""A team of robots as data: where it drives, what for, and what may go wrong between its robots and its coordinator."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, field_validator, model_validator

from touchline.schemas.faults import AnyFault
from touchline.schemas.given_angles import Angle
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.overhead_cameras import Hiding
from touchline.schemas.scenario import CameraNoise, Coordinate, Pose2, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.topics import NAMESPACE_RULE, is_namespace
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own

Point = tuple[Coordinate, Coordinate]
Ring = Annotated[tuple[Point, ...], Field(min_length=3, max_length=1000)]
MOST_ROBOTS: Final = 1024
LOSSY_LEASE_S: Final = 2.4
"""A lease that suits messages up to half of which are lost, and that are late: a round trip, and the loss of a few."""
BY_PLANS: Final = ("battery-low", "camera-outage", "camera-swapped")
"""Faults with which robots still follow their plans to the ends, where they stand."""
_OFF_PLAN: Final = (
    "stops a robot where its plan does not, and plans of others may lead there at once: plans cannot keep them apart; "
    "use avoid: cells"
)
PLACE_M2: Final = 2.5
"""Of an area that is not said, for each robot."""


class TeamArea(Spec):
    """Area in which a team drives: a polygon, convex or not, less obstacles (m, map frame)."""

    outline: Ring
    obstacles: Annotated[tuple[Ring, ...], Field(max_length=5000)] = ()
    obstacle_height_m: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """Height of obstacles, which hide robots from cameras; 0: they hide none."""


class ImportantDisc(Spec):
    """A disc that is more important to be near to; where discs overlap, their values add up."""

    x_m: Coordinate
    y_m: Coordinate
    radius_m: Annotated[float, Field(gt=0, le=10_000)]
    value: Annotated[float, Field(ge=0, le=1e6)]


class ImportanceRaster(Spec):
    """Squares of their own importance, row by row along y from a corner; nothing is important outside."""

    values: Annotated[tuple[tuple[Annotated[float, Field(ge=0, le=1e6)], ...], ...], Field(min_length=1)]
    pixel_m: Annotated[float, Field(gt=0, le=1000)]
    x_m: Coordinate = 0.0
    y_m: Coordinate = 0.0

    @model_validator(mode="after")
    def _is_a_rectangle(self) -> Self:
        if not self.values[0] or len({len(row) for row in self.values}) > 1:
            raise ValueError("values must have rows of one length, at least one number each")
        return self


class Importance(Spec):
    """φ, how important it is to be near to which place: a value everywhere and more in discs, or a raster."""

    value: Annotated[float, Field(ge=0, le=1e6)] = 1.0
    discs: Annotated[tuple[ImportantDisc, ...], Field(max_length=100)] = ()
    raster: ImportanceRaster | None = None

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Self:
        if self.raster is not None and self.discs:
            raise ValueError("raster and discs exclude each other: leave one of both out")
        return self


class DeployTask(Spec):
    """Spread over the area, each robot near to its share of it."""

    kind: Literal["deploy"] = "deploy"
    importance: Importance = Importance()


class SwapTask(Spec):
    """Each robot to the opposite place, across the middle of all."""

    kind: Literal["swap"]


class GoalsTask(Spec):
    """Each robot to its goals (x, y in m) in turn, by its name; who has none stays."""

    kind: Literal["goals"]
    goals: dict[str, Annotated[tuple[Point, ...], Field(min_length=1, max_length=1000)]]


class FormationTask(Spec):
    """In formation: a line, a circle or a grid about a place, each robot to the nearest free place of it."""

    kind: Literal["formation"]
    shape: Literal["line", "circle", "grid"] = "circle"
    x_m: Coordinate
    y_m: Coordinate
    heading_rad: Angle = 0.0
    apart_m: Annotated[float, Field(gt=0, le=1000)] = 1.0


PlainTaskSpec = DeployTask | SwapTask | GoalsTask | FormationTask
TaskSpec = Annotated[PlainTaskSpec | DispatchTask, Field(discriminator="kind")]


class TeamLinks(Spec):
    """Radio between the robots and their coordinator: what is lost, and how late the rest comes."""

    loss: Annotated[float, Field(ge=0, le=0.95)] = 0.0
    delay_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    """Messages take up to this long, each its own time, so that they overtake each other."""

    @property
    def lossless(self) -> bool:
        """True if every message arrives at once."""
        return self.loss == 0.0 and self.delay_s == 0.0


class TeamRadio(Spec):
    """Radio between robots whose algorithm is distributed.

    Each robot may send one message to all at every update; each receiver has its own luck with it.
    """

    topology: Literal["disc", "nearest", "graph"] = "disc"
    """Receivers of a message: all within `range_m`, all that have the sender among their `nearest`, or `graph`."""
    range_m: Annotated[float, Field(gt=0, le=10_000)] = 2.0
    nearest: Annotated[int, Field(ge=1, le=MOST_ROBOTS)] = 4
    graph: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    """Receivers by sender."""
    walls: bool = False
    """True: walls stop messages."""
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of messages lost, by receiver."""
    delay_least_s: Annotated[float, Field(ge=0, le=60)] = 0.02
    delay_most_s: Annotated[float, Field(ge=0, le=60)] = 0.08
    """Messages take from `delay_least_s` to `delay_most_s`, each its own time."""
    bytes_per_s: Annotated[float, Field(gt=0, le=1e9)] = 10_000.0
    """Capacity of each sender; further messages are not sent."""

    @model_validator(mode="after")
    def _has_least_before_most(self) -> Self:
        if self.delay_least_s > self.delay_most_s:
            raise ValueError("delay_least_s is more than delay_most_s: give the smaller one first")
        return self


class AlgorithmChoice(Spec):
    """Algorithm that decides where robots drive."""

    use: Annotated[str, Field(min_length=1, max_length=4096)]
    """Name of a plug-in, or `FILE.py:NAME`: a class or function that makes it."""
    options: dict[str, float | int | str | bool] = Field(default_factory=dict)
    """Its keyword arguments."""


class Freeze(Spec):
    """A robot's computer stands still, and with it the robot: from a sim time on, for a while or for ever."""

    start_s: Annotated[float, Field(ge=0, le=100_000)]
    duration_s: Annotated[float, Field(gt=0, le=100_000)] | None = None


class TeamScenario(Spec):
    """A team, its area and its task; what is left out is as by default.

    Robots are called `tb1`, `tb2`, … unless they are given by name with their places. Without places they start from a
    grid in a corner of the area, or, to change places, from a circle.
    """

    name: str = "team"
    """Name for people."""
    robots: Annotated[int, Field(ge=1, le=MOST_ROBOTS)] = 10
    """Number of robots: `tb1`, `tb2`, …"""
    places: dict[str, Pose2] = Field(default_factory=dict)
    """Start pose of each robot by name; there are then no others."""
    area: TeamArea | None = None
    """`outline` and `obstacles`, corners in m; null: a square of 2.5 m² a robot."""
    task: TaskSpec = DeployTask()
    """`deploy` with an `importance`, `swap`, `goals`, `formation` or `dispatch`."""
    algorithm: AlgorithmChoice | None = None
    """`use` and `options` of the algorithm that decides where robots drive; null: the task does."""
    radio: TeamRadio = TeamRadio()
    """Radio between robots, for distributed algorithms."""
    vehicle: Vehicle = SHIPPED["turtlebot2"].vehicle
    """Vehicle of all robots; default: `turtlebot2`."""
    onboard: OnboardConfig = with_its_own("turtlebot2", OnboardConfig())
    """Configuration of all computers."""
    world: Scenario = on_its_ground("turtlebot2", Scenario())
    """Scenario of all robots; the seed of `tb7` is 6 more than the world's."""
    avoid: Literal["cells", "plans", "barriers", "none"] = "cells"
    """Collision avoidance; `none`: paths of their own, as in the study, or as an algorithm wishes.

    With `none` the follower is `frenet`, the speed that of the study's law.
    """
    path: Literal["bearing", "free"] = "bearing"
    """Heading at the goal for robots that avoid nobody: the bearing, or any."""
    radius_m: Annotated[float, Field(gt=0, le=100)] = 0.2
    """Radius r_s that each centre keeps free.

    It is kept from walls, and half of what two robots keep from each other: it holds the body, and the errors of
    estimate, follower and delay.
    """
    update_s: Annotated[float, Field(ge=0.1, le=5, multiple_of=0.1)] = 0.4
    """Time from one set of cells to the next."""
    links: TeamLinks = TeamLinks()
    """`loss` (share of messages) and `delay_s` (largest delay)."""
    faults: dict[str, Annotated[tuple[AnyFault, ...], Field(max_length=100)]] = Field(default_factory=dict)
    """Faults by robot.

    Faults of `world` apply to all.
    """
    frozen: dict[str, Annotated[tuple[Freeze, ...], Field(max_length=100)]] = Field(default_factory=dict)
    """Times at which a robot's computer stands still: `start_s`, `duration_s`, by robot.

    Only where robots and coordinator are of one process.
    """
    duration_s: Annotated[float, Field(gt=0, le=100_000)] = 120.0
    """Longest sim time; goals, swaps and formations end on arrival, dispatch with its last task."""

    @model_validator(mode="after")
    def _names_robots_that_there_are(self) -> Self:
        for field in ("faults", "frozen"):
            for name in getattr(self, field):
                if name not in self.names:
                    raise ValueError(
                        f"{field} names {name!r}, which is no robot of the team: use {self.names[0]} or so"
                    )
        for name in {*self.radio.graph, *(each for receivers in self.radio.graph.values() for each in receivers)}:
            if name not in self.names:
                problem = f"radio.graph names {name!r}, which is no robot of the team"
                raise ValueError(f"{problem}: use {self.names[0]} or so")
        for name in self.task.charges if isinstance(self.task, DispatchTask) else ():
            if name not in self.names:
                raise ValueError(
                    f"task.charges names {name!r}, which is no robot of the team: use {self.names[0]} or so"
                )
        return self

    @field_validator("places")
    @classmethod
    def _can_be_keys(cls, places: dict[str, Any]) -> dict[str, Any]:
        for name in places:
            if not is_namespace(name):
                raise ValueError(f"the name {name!r} cannot be a robot's: {NAMESPACE_RULE}")
        if len(places) > MOST_ROBOTS:
            raise ValueError(f"are {len(places)} robots; give at most {MOST_ROBOTS}")
        return places

    @property
    def names(self) -> tuple[str, ...]:
        """Of all robots, sorted as text."""
        return tuple(sorted(self.places or (f"tb{number}" for number in range(1, self.robots + 1))))

    @property
    def by_plans(self) -> bool:
        """True if robots are guided by plans instead of cells; plans may also keep apart from nothing."""
        return self.avoid in ("plans", "barriers") or (self.avoid == "none" and self.algorithm is not None)

    @property
    def faulty(self) -> bool:
        """True if a robot has a fault at some time."""
        return bool(self.faults or self.world.faults or self.frozen)

    @model_validator(mode="after")
    def _can_follow_plans(self) -> Self:
        if not self.by_plans:
            return self
        for fault in (*self.world.faults, *(each for faults in self.faults.values() for each in faults)):
            if fault.kind not in BY_PLANS:
                raise ValueError(f"the fault {fault.kind} {_OFF_PLAN}, or {', '.join(BY_PLANS)}")
        if self.frozen:
            raise ValueError(f"frozen {_OFF_PLAN}")
        return self

    @model_validator(mode="after")
    def _can_dispatch(self) -> Self:
        if isinstance(self.task, DispatchTask) and self.avoid == "none" and self.algorithm is None:
            raise ValueError("avoid is 'none', and a dispatcher avoids nobody: use avoid: cells, plans or barriers")
        return self

    def setup(self, name: str, start: Pose2) -> Setup:
        """Setup that decides a robot's session.

        Args:
            name: One of `names`.
            start: Where it stands.
        """
        faults = (*self.world.faults, *self.faults.get(name, ()))
        world = self.world.model_copy(update={"start": start, "faults": faults, "camera": self._camera()})
        if isinstance(self.task, DispatchTask):
            docks = tuple(self.task.docks.values())
            world = world.model_copy(update={"docks": docks, "charge": self.task.charges.get(name, 1.0)})
        follower = self.onboard.follower if self.avoid != "none" else "frenet"
        onboard = self.onboard.model_copy(update={"follower": follower})
        setup = Setup(vehicle=self.vehicle, onboard=onboard, scenario=world)
        return setup.with_seed(world.seed + self.number_of(name))

    def _camera(self) -> CameraNoise:
        """The cameras of the world, with the obstacles that hide robots from them."""
        camera, area = self.world.camera, self.area
        if area is None or not area.obstacle_height_m or not camera.cameras:
            return camera
        walls = tuple(Hiding(outline=ring, height_m=area.obstacle_height_m) for ring in area.obstacles)
        return camera.model_copy(update={"hiding": (*camera.hiding, *walls)})

    def number_of(self, name: str) -> int:
        """The robot's number: of `tb7` 6, so that a further robot changes no other's noise; else its place in the list.

        Of one that is no robot of the team, the number of its robots.
        """
        digits = name.removeprefix("tb")
        if digits.isdigit() and name.startswith("tb"):
            return int(digits) - 1
        return self.names.index(name) if name in self.names else len(self.names)
