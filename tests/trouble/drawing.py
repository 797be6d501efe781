"""Drawing of cases, each from its number alone."""

import math
import random
from typing import Any, Final, get_args

from benchmarks._invariants import timeline
from tests.trouble.case import Case, Order, OrderName
from touchline.schemas.scenario import Ground, GroundWave, Multipath, Scenario
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.truth import Truth

TRUTHS: Final[dict[str, tuple[float, ...]]] = {
    "wheel_radius_relative": (-0.01, 0.01),
    "wheel_difference_relative": (-0.01, 0.005),
    "track_width_relative": (-0.01, 0.01),
    "antenna_x_m": (-0.03, 0.01),
    "antenna_y_m": (-0.01, 0.03),
    "mast_left_rad": (-0.02, 0.02),
    "nozzle_y_m": (-0.01, 0.01),
    "gyro_scale_relative": (-0.01, 0.01),
    "gyro_lean_x_rad": (0.02,),
    "hard_iron_x_t": (3e-6, -3e-6),
    "stamp_offset_s": (-0.03, 0.03),
    "stamp_jitter_s": (0.01,),
    "base_east_m": (-0.02, 0.02),
    "crab_rad": (-0.02, 0.02),
    "wander_rad": (0.01, 0.02),
    "vibration_mps2": (0.4,),
    "patch_slip_relative": (0.03,),
    "drift_east_m": (0.002,),
}
"""Figures of the mismatch benchmark, either way."""
GROUNDS: Final = (
    Ground(grade=0.05, uphill_rad=1.0),
    Ground(surface="wet-grass"),
    Ground(surface="clay"),
    Ground(roughness="C"),
    Ground(waves=(GroundWave(rise_m=0.02, length_m=1.6),)),
)
_AROUND: Final = ((-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0))
LAST_TICK: Final = 4000


def drawn(number: int) -> Case:
    """Case of a number: 5 to 20 m of lines, and up to some mismatches, faults and orders."""
    draw = random.Random(f"trouble {number}")
    return Case(
        template=_template(draw),
        scenario=_scenario(draw, number),
        orders=_orders(draw),
        follower=draw.choice(("mpc", "mpc", "pure-pursuit")),
    )


def _template(draw: random.Random) -> Template:
    """One to four lines and arcs, here and there, and not across one another's ends by design."""
    segments, count = [], draw.randint(1, 4)
    for i in range(count):
        x, y, heading = (round(draw.uniform(*bounds), 2) for bounds in ((0.0, 6.0), (0.0, 6.0), (-math.pi, math.pi)))
        length = round(draw.uniform(1.5, 5.0), 2)
        if draw.random() < 0.3:
            radius = round(draw.uniform(1.0, 4.0), 2)
            arc = ArcSpec(start=(x + radius, y), center=(x, y), sweep_angle=draw.choice((-1, 1)) * length / radius)
            segments.append(TemplateSegment(id=f"s{i}", arc=arc))
        else:
            end = round(x + length * math.cos(heading), 3), round(y + length * math.sin(heading), 3)
            segments.append(TemplateSegment(id=f"s{i}", line=LineSpec(start=(x, y), end=end)))
    return Template(name="trouble", segments=tuple(segments))


def _scenario(draw: random.Random, number: int) -> Scenario:
    parts: dict[str, Any] = {"seed": draw.randint(1, 1000)}
    if draw.random() < 0.6:
        names = draw.sample(sorted(TRUTHS), draw.randint(1, 3))
        parts["truth"] = Truth(**{name: draw.choice(TRUTHS[name]) for name in names})
    if draw.random() < 0.3:
        parts["ground"] = draw.choice(GROUNDS)
    if draw.random() < 0.1:
        parts["multipath"] = (Multipath(outline=_AROUND),)
    if draw.random() < 0.6:
        parts["faults"] = timeline(number)[:3]
    return Scenario(**parts)


def _orders(draw: random.Random) -> tuple[Order, ...]:
    names: tuple[OrderName, ...] = get_args(OrderName)
    count = draw.choice((0, 1, 1, 2, 3))
    orders = [Order(tick=draw.randint(1, LAST_TICK), name=draw.choice(names)) for _ in range(count)]
    return tuple(sorted(orders, key=lambda order: order.tick))
