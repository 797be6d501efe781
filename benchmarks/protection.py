"""Protection: contacts and mean speed among people who walk, aim at the robot or step out, and stops for what appears.

`python -m benchmarks protection`; `minutes` among eight adversaries, a fifth of that with each figure of the
protection left out, `phases` of the scan at which something appears for each stop.
"""

import math
from collections.abc import Mapping

from benchmarks._settings import Small
from benchmarks._stops_for_things import stop_for, with_lidar
from touchline.schemas.catalogue import load_vehicle
from touchline_research.obstacles.crowd import EIGHT, WALKER, Met, meet_people, protected

RANGE_ERROR_M = 0.1
"""Error of the lidar with which each figure is left out, to use up what margin and bound on the error allow."""
LEFT_OUT: dict[str, dict[str, float]] = {
    "nothing": {},
    "creep": {"creep_s": 0.0},
    "lag": {"reaction_s": 0.02},
    "margin": {"margin_m": 0.0},
    "growth": {"thing_mps": 0.0},
}
"""Figures of the protection with one of them left out."""
STOPS = (
    ("turf-tank-two", "grass", 1.0),
    ("turf-tank-two", "grass", 1.4),
    ("turf-tank-two", "wet-grass", 1.0),
    ("turf-tank-two", "wet-grass", 1.4),
    ("turtlebot2", "floor", 0.5),
    ("clay-roller", "clay", 1.0),
)
SMALL = Small(
    {"minutes": 5.0, "phases": 1},
    (
        "# min among eight people: # contacts in motion, # at rest, closest # m, mean # m/s",
        "# min with one walker: # contacts in motion, # at rest, closest # m, mean # m/s",
        "# min with #° behind that the lidar does not see: # contacts in motion, # from there",
        *(f"lidar wrong by # m, {name} left out: # contacts in motion in # min, closest # m" for name in LEFT_OUT),
        *(f"{name} on {ground}, # m/s: at most # of the bound # m" for name, ground, _ in STOPS),
    ),
)


def main(minutes: float = 1000.0, phases: int = 10) -> None:
    """Run the benchmark, and print its figures."""
    vehicle = with_lidar(load_vehicle("turf-tank-two"))
    for kinds, named in ((EIGHT, "among eight people"), ((WALKER,), "with one walker")):
        computer = protected(vehicle)
        computer.way.error_m = 0.01
        met = meet_people(vehicle, computer, kinds, minutes)
        print(f"{minutes:g} min {named}: {met.moving} contacts in motion, {met.standing} at rest, ", end="")
        print(f"closest {met.closest_m:.3f} m, mean {met.mean_mps:.2f} m/s")
    met = meet_people(vehicle, protected(vehicle), EIGHT, minutes, blind_rad=0.5 * math.pi)
    print(f"{minutes:g} min with 90° behind that the lidar does not see: {met.moving} contacts in motion, ", end="")
    print(f"{met.behind} from there")
    for name, figures in LEFT_OUT.items():
        met = without(figures, 0.2 * minutes)
        print(f"lidar wrong by {RANGE_ERROR_M:g} m, {name} left out: {met.moving} contacts in motion ", end="")
        print(f"in {0.2 * minutes:g} min, closest {met.closest_m:.3f} m")
    _stops(phases)


def without(figures: Mapping[str, float], minutes: float) -> Met:
    """Let a robot with other figures of its protection drive among eight people whom its lidar sees too far away.

    Args:
        figures: Fields of `WayState`, as in `LEFT_OUT`.
        minutes: Duration.
    """
    vehicle = with_lidar(load_vehicle("turf-tank-two"))
    computer = protected(vehicle)
    for name, value in {"error_m": 0.03, **figures}.items():
        setattr(computer.way, name, value)
    return meet_people(vehicle, computer, EIGHT, minutes, bias_m=RANGE_ERROR_M)


def _stops(phases: int) -> None:
    for name, surface, speed_mps in STOPS:
        stops = [stop_for(load_vehicle(name), surface, speed_mps, phase) for phase in range(phases)]
        worst = max(stops, key=lambda stop: stop.way_m / stop.bound_m)
        print(f"{name} on {surface}, {speed_mps} m/s: at most {worst.way_m / worst.bound_m:.2f} ", end="")
        print(f"of the bound {worst.bound_m:.3f} m")
