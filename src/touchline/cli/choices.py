"""Groups of options: planning, vehicle and setup."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
import typer

from touchline.cli.options import refuse_options
from touchline.cli.plugin_option import PluginOption
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import AREA_METHODS, ASKED, FOLLOWERS, METHODS
from touchline.schemas.scenario import MAX_SEED, Noise, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec, parse, read_text
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import DEFAULT_NAME, SHIPPED, on_its_ground, with_its_own

Order = Literal["optimised", "given"]


@dataclass(frozen=True)
class PlanChoice:
    """Planning options of commands that plan."""

    order: Annotated[
        Order,
        typer.Option(
            metavar="ORDER", help="Order of the lines: least time (optimised), or as in the template (given)."
        ),
    ] = "optimised"
    method: Annotated[
        str,
        PluginOption("--method", METHODS, "METHOD", "Transitions between lines, or an area method", also=AREA_METHODS),
    ] = METHODS.default
    area_method: Annotated[
        str | None,
        PluginOption(
            "--area-method",
            AREA_METHODS,
            "METHOD",
            "Area method",
            "parallel for a sprayer, lap-and-lanes for a roller",
        ),
    ] = None
    kappa_max: Annotated[
        float,
        typer.Option(
            metavar="1/M", help="Largest curvature of turns, 1/m (0: the method's default).", show_default=False
        ),
    ] = 0.0
    sigma_max: Annotated[
        float,
        typer.Option(
            metavar="1/M²", help="Largest sharpness dκ/ds, 1/m² (0: the method's default).", show_default=False
        ),
    ] = 0.0
    paint_speed: Annotated[
        float,
        typer.Option(
            metavar="M/S", help="Speed while marking or covering, m/s (0: vehicle default).", show_default=False
        ),
    ] = 0.0
    transit_speed: Annotated[
        float, typer.Option(metavar="M/S", help="Speed in transitions, m/s (0: vehicle default).", show_default=False)
    ] = 0.0
    forward_only: Annotated[
        bool, typer.Option("--forward-only", help="Drive forward only: neither reverse nor turn on the spot.")
    ] = False
    drying_time: Annotated[
        float, typer.Option(metavar="S", help="Drying time of the paint, s (0: vehicle default).", show_default=False)
    ] = 0.0
    hard_drying: Annotated[bool, typer.Option("--hard-drying", help="Fail rather than drive over wet paint.")] = False
    obstructed: Annotated[
        str,
        typer.Option(
            metavar="leave-out|refuse",
            help="Obstructed parts of lines: leave them out and report them (default), or fail.",
            show_default=False,
        ),
    ] = ""
    return_to_start: Annotated[
        bool, typer.Option("--return", help="End at the start pose, not behind the last line.")
    ] = False

    overlap: Annotated[float, typer.Option(metavar="M", help="Areas: minimum overlap of neighbouring lanes, m.")] = 0.03
    margin: Annotated[
        float, typer.Option(metavar="M", help="Areas: clearance between body and outline, m (40 % less in turns).")
    ] = 0.05
    laps: Annotated[
        int, typer.Option(metavar="N", help="Areas: laps along the outline (0: none; -1: as many as needed).")
    ] = -1
    swath_angle: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES",
            help="Areas: direction of the lanes, degrees counter-clockwise from +x (default: the best one).",
        ),
    ] = None
    coverage: Annotated[
        float,
        typer.Option(
            metavar="PERCENT",
            help="Areas: minimum coverage of the reachable area, percent (0: touch up only where it costs little).",
            show_default=False,
        ),
    ] = 0.0

    def options(self) -> PlanOptions:
        """Return the plan request's options.

        Raises:
            SpecError: A value is not usable; the message names the option.
        """
        for name in ("kappa_max", "sigma_max", "paint_speed", "transit_speed", "drying_time", "overlap", "margin"):
            value = getattr(self, name)
            if not 0 <= value < float("inf"):
                option = "--" + name.replace("_", "-")
                raise SpecError("command line", option, f"is {value}", "give a positive number, or leave it out")
        return PlanOptions(
            method=self.method,
            area_method=self.area_method or "",
            kappa_max_1pm=self.kappa_max,
            sigma_max_1pm2=self.sigma_max,
            paint_speed_mps=self.paint_speed,
            transit_speed_mps=self.transit_speed,
            order=self.order,
            forward_only=self.forward_only,
            drying_time_s=self.drying_time,
            hard_drying=self.hard_drying,
            obstructed=self.obstructed,
            return_to_start=self.return_to_start,
            overlap_m=self.overlap,
            margin_m=self.margin,
            laps=self.laps,
            swath_angle_deg=np.array([] if self.swath_angle is None else [self.swath_angle]),
            coverage_pct=self.coverage,
        )


def check_follower(config: OnboardConfig) -> None:
    """Refuse an external follower where there is no bus to reach it.

    Raises:
        SpecError: The configuration names an external follower.
    """
    if config.follower in ASKED:
        remedy = "use `touchline run` or `up`, whose bus it can join"
        raise SpecError("onboard", "follower", f"is {config.follower!r}", remedy)


VehicleOption = Annotated[
    Path | None,
    typer.Option(
        "--vehicle",
        metavar="NAME|FILE",
        help=f"Robot: a shipped one ({', '.join(SHIPPED)}) or a JSON file (default: the first).",
    ),
]


@dataclass(frozen=True)
class VehicleChoice:
    """Vehicle option: dimensions and limits of the robot."""

    vehicle: VehicleOption = None

    @property
    def name(self) -> str:
        """The name or path that is given, or the default one."""
        return str(self.vehicle or DEFAULT_NAME)

    def chosen(self) -> Vehicle:
        """The vehicle of the given name or file, or the default one.

        Raises:
            SpecError: No such vehicle, or the file is not a vehicle.
        """
        return load_vehicle(self.vehicle) if self.vehicle else Vehicle()


@dataclass(frozen=True)
class SetupChoice:
    """Setup of a robot: files of its world, computer and vehicle, and options that override them."""

    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Scenario JSON file: the robot's world; --seed and --noise override it."),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Seed of all noise: the same seed gives the same session (default: 1).",
            min=0,
            max=MAX_SEED,
        ),
    ] = None
    noise: Annotated[
        Noise | None, typer.Option(metavar="NOISE", help="Sensor and actuator noise: default or none.")
    ] = None
    onboard: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="JSON file of the onboard computer: data sheets, limits; --follower overrides it."
        ),
    ] = None
    follower: Annotated[str | None, PluginOption("--follower", FOLLOWERS, "NAME", "Path follower")] = None
    vehicle: VehicleOption = None

    def chosen(self) -> Setup:
        """Return the files' contents, or the defaults, with the options applied.

        Raises:
            SpecError: A file is not usable.
        """
        body = VehicleChoice(self.vehicle)
        return Setup(
            vehicle=body.chosen(),
            onboard=_changed(with_its_own(body.name, _read(OnboardConfig, self.onboard)), follower=self.follower).on(
                _today()
            ),
            scenario=_changed(
                on_its_ground(body.name, _read(Scenario, self.scenario)), seed=self.seed, noise=self.noise
            ),
        )

    def refuse_with(self, other: str, remedy: str) -> None:
        """Refuse these options beside ``other``, which already contains them.

        Raises:
            SpecError: One of them is given.
        """
        self.refuse(f"and {other} is given, too", remedy)

    def refuse(self, problem: str, remedy: str) -> None:
        """Refuse these options for the given reason.

        Raises:
            SpecError: One of them is given.
        """
        refuse_options(self, problem, remedy)

    def chosen_robots(self, fleet: Path | None, namespaces: Sequence[str]) -> dict[str, Setup]:
        """Return the robots in the file ``fleet``; without it, robots of these names with the options applied.

        Robots that differ in nothing else get consecutive seeds.

        Raises:
            SpecError: A file is not usable, or an option would override every robot of the file.
        """
        if fleet is not None:
            self.refuse_with("--robots", f"set it for each robot in {fleet.name}")
            setups = Fleet.read(fleet).setups()
            return {name: _of_today(setup) for name, setup in setups.items()}
        setup = self.chosen()
        return {name: setup.with_seed(setup.scenario.seed + number) for number, name in enumerate(namespaces)}


S = TypeVar("S", bound=Spec)


def _today() -> date:
    return datetime.now(UTC).date()


def _of_today(setup: Setup) -> Setup:
    return setup.model_copy(update={"onboard": setup.onboard.on(_today())})


def _read(kind: type[S], path: Path | None) -> S:
    return parse(kind, read_text(path), path.name) if path else kind()


def _changed(spec: S, **changes: object) -> S:
    return spec.model_copy(update={name: value for name, value in changes.items() if value is not None})
