"""Options that several subcommands share, and the exit codes."""

import json
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from schemas.errors import SpecError
from schemas.messages import PlanOptions
from schemas.scenario import Scenario
from schemas.spec import parse, read_text

PLOT_ENDINGS = (".svg", ".png")


class ExitCode(IntEnum):
    """What the command's exit code says."""

    OK = 0
    FAILED = 1
    UNUSABLE = 2
    INTERRUPTED = 130


class Method(StrEnum):
    """Transition methods."""

    G2 = "g2"
    CCD = "ccd"
    DUBINS_PADDED = "dubins-padded"


class Order(StrEnum):
    """Orders of painted segments."""

    OPTIMISED = "optimised"
    GIVEN = "given"


class Colour(StrEnum):
    """What colours the plot of a plan."""

    PLAIN = "plain"
    SPEED = "speed"
    CURVATURE = "curvature"


class Follower(StrEnum):
    """Path followers."""

    MPC = "mpc"
    PURE_PURSUIT = "pure-pursuit"
    EXTERNAL = "external"


class Noise(StrEnum):
    """Noise profiles."""

    DEFAULT = "default"
    NONE = "none"


TemplateArgument = Annotated[
    str,
    typer.Argument(help="A shipped template's name (see `touchline templates`) or a JSON file.", show_default=False),
]
MethodOption = Annotated[
    Method,
    typer.Option(
        help="How painted lines are joined: by time, curvature-continuous; CC words; plain Dubins with padding."
    ),
]
KappaOption = Annotated[
    float,
    typer.Option("--kappa-max", help="Largest curvature of a turn, 1/m; 0: what the wheels allow.", show_default=False),
]
SigmaOption = Annotated[
    float,
    typer.Option("--sigma-max", help="Largest sharpness dκ/ds, 1/m²; 0: what the wheels allow.", show_default=False),
]
PaintSpeedOption = Annotated[
    float, typer.Option("--paint-speed", help="Speed while painting, m/s; 0: the vehicle's.", show_default=False)
]
TransitSpeedOption = Annotated[
    float, typer.Option("--transit-speed", help="Speed in between, m/s; 0: the vehicle's.", show_default=False)
]
OrderOption = Annotated[Order, typer.Option("--order", help="Paint in an order that takes least time, or as given.")]
ForwardOnlyOption = Annotated[bool, typer.Option("--forward-only", help="Neither reverse nor turn on the spot.")]
ReturnOption = Annotated[bool, typer.Option("--return", help="End where it began, not behind the last line.")]
DryingTimeOption = Annotated[
    float, typer.Option("--drying-time", help="Paint stays wet so long, s; 0: the vehicle's.", show_default=False)
]
HardDryingOption = Annotated[
    bool, typer.Option("--hard-drying", help="Rather give no plan than drive over paint that is wet.")
]
ScenarioOption = Annotated[
    Path | None,
    typer.Option(
        "--scenario", help="Scenario JSON file; the options below take precedence over it.", show_default=False
    ),
]
SeedOption = Annotated[
    int | None,
    typer.Option(help="Seed of every noise: the same seed gives the same session; default 1.", min=0),
]
FollowerOption = Annotated[Follower | None, typer.Option(help="What steers the robot along the path; default mpc.")]
NoiseOption = Annotated[Noise | None, typer.Option(help="Sensor and actuator noise; default: on.")]
SpeedOption = Annotated[
    str, typer.Option("--speed", help="Times real time (1, 20, 0.5 …), or `max` for as fast as it goes.")
]
ReportOption = Annotated[
    Path | None, typer.Option("--report", help="Write the figures to this JSON file.", show_default=False)
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
SupervisedOption = Annotated[
    bool, typer.Option("--supervised", hidden=True, help="End when the parent process is gone.")
]


def chosen_scenario(file: Path | None, seed: int | None, follower: Follower | None, noise: Noise | None) -> Scenario:
    """The scenario in ``file`` (or the default one), with what is given on the command line instead of its own.

    Raises:
        SpecError: The file is not a scenario.
    """
    changes = {"seed": seed, "follower": follower and follower.value, "noise": noise and noise.value}
    given = parse(Scenario, read_text(file), file.name) if file else Scenario()
    return given.model_copy(update={name: value for name, value in changes.items() if value is not None})


def plan_options(
    method: Method,
    *,
    kappa_max: float = 0.0,
    sigma_max: float = 0.0,
    paint_speed: float = 0.0,
    transit_speed: float = 0.0,
    order: Order = Order.OPTIMISED,
    forward_only: bool = False,
    drying_time: float = 0.0,
    hard_drying: bool = False,
    return_to_start: bool = False,
) -> PlanOptions:
    """The plan request's options; what cannot be meant is refused here, by the option's name."""
    named = {
        "--kappa-max": kappa_max,
        "--sigma-max": sigma_max,
        "--paint-speed": paint_speed,
        "--transit-speed": transit_speed,
        "--drying-time": drying_time,
    }
    for name, value in named.items():
        if not 0 <= value < float("inf"):
            raise SpecError("command line", name, f"is {value}", "give a positive number, or leave it out")
    return PlanOptions(
        method=method.value,
        kappa_max_1pm=kappa_max,
        sigma_max_1pm2=sigma_max,
        paint_speed_mps=paint_speed,
        transit_speed_mps=transit_speed,
        order=order.value,
        forward_only=forward_only,
        drying_time_s=drying_time,
        hard_drying=hard_drying,
        return_to_start=return_to_start,
    )


def speed_factor(text: str) -> float:
    """``max`` as −1, otherwise the number.

    Raises:
        SpecError: It is neither.
    """
    if text == "max":
        return -1.0
    try:
        factor = float(text)
    except ValueError:
        factor = -1.0
    if not 0 < factor <= 10_000:
        raise SpecError("command line", "--speed", f"is {text!r}", "give a number above 0 (times real time) or max")
    return factor


def check_plot(path: Path | None, option: str = "--plot") -> None:
    """Refuse a picture of a kind that cannot be drawn, before any work is done.

    Raises:
        SpecError: The file's ending is none of ours.
    """
    if path is not None and path.suffix not in PLOT_ENDINGS:
        raise SpecError("command line", option, f"ends in {path.suffix!r}", f"use {' or '.join(PLOT_ENDINGS)}")


def write_json(figures: dict[str, Any], path: Path) -> None:
    """Write ``figures`` to ``path``.

    Raises:
        SpecError: It cannot be written.
    """
    try:
        path.write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise SpecError(str(path), "", f"cannot be written ({error.strerror})", "give a writable path") from error
