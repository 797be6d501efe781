"""Random poses, curves and templates for the planner's property tests."""

import math

from hypothesis import strategies as st

from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.services.planner.geometry.clothoid import PathPose, Piece


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


headings = floats(-math.pi, math.pi)
poses = st.builds(PathPose, floats(-10, 10), floats(-10, 10), headings)
# Near misses are where words change, deflections wrap and pieces shrink to nothing.
nudges = st.one_of(st.just(0.0), floats(-1e-3, 1e-3), floats(-1e-9, 1e-9))


@st.composite
def pose_pairs(draw: st.DrawFn) -> tuple[PathPose, PathPose]:
    start = draw(poses)
    if draw(st.booleans()):
        return start, draw(poses)
    ahead = draw(st.one_of(st.just(0.0), floats(0.0, 5.0)))
    return start, start.moved(complex(ahead + draw(nudges), draw(nudges)), draw(nudges))


limits = st.tuples(floats(0.2, 2.0), floats(0.1, 10.0))
sharpnesses = st.one_of(st.just(0.0), floats(-4.0, 4.0))


def forward_pieces(
    lengths: st.SearchStrategy[float], curvatures: st.SearchStrategy[float], sharpness: st.SearchStrategy[float]
) -> st.SearchStrategy[Piece]:
    return st.builds(Piece, lengths, curvatures, sharpness, st.just(1), st.just(0.0))


pieces = forward_pieces(floats(0.0, 3.0), floats(-2.0, 2.0), sharpnesses)
moves = st.one_of(pieces, pieces.map(lambda piece: piece._replace(direction=-1)), st.builds(Piece.spin, headings))


@st.composite
def template_segments(draw: st.DrawFn, index: int) -> TemplateSegment:
    x, y, heading = draw(floats(-30, 30)), draw(floats(-30, 30)), draw(headings)
    actuation = draw(st.sampled_from(["SPRAY", "DISC_SPRAY"]))
    if draw(st.booleans()):
        length = draw(floats(0.05, 20.0))
        line = LineSpec(start=(x, y), end=(x + length * math.cos(heading), y + length * math.sin(heading)))
        return TemplateSegment(id=f"s{index}", line=line, actuation=actuation)
    radius, sweep = draw(floats(0.6, 12.0)), draw(floats(0.1, 2.0 * math.pi)) * draw(st.sampled_from([-1.0, 1.0]))
    center = (x + radius * math.cos(heading), y + radius * math.sin(heading))
    return TemplateSegment(
        id=f"s{index}", arc=ArcSpec(start=(x, y), center=center, sweep_angle=sweep), actuation=actuation
    )


@st.composite
def templates(draw: st.DrawFn) -> Template:
    count = draw(st.integers(1, 5))
    return Template(name="random", segments=tuple(draw(template_segments(i)) for i in range(count)))
