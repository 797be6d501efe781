"""Robots share the parts of lines that can be reached round what stands on the field."""

import pytest

from touchline.jobs.shared.shared_job import SharedJob, share_reachable
from touchline.jobs.shared.shared_simulation import simulate_shared
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.template import LineSpec, Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle

POST = Polygon(id="post", corners=((7.94, 11.94), (8.06, 11.94), (8.06, 12.06), (7.94, 12.06)))
SHED = Polygon(id="shed", corners=((-1.0, 11.0), (17.0, 11.0), (17.0, 13.0), (-1.0, 13.0)))
LINES = {"south": (0.0, 16.0), "posted": (0.0, 16.0), "north": (0.0, 16.0)}
TEMPLATE = Template(
    name="posted",
    segments=(
        *(
            TemplateSegment(id=name, line=LineSpec(start=(a, 12.0 * k), end=(b, 12.0 * k)))
            for k, (name, (a, b)) in enumerate(LINES.items())
        ),
        TemplateSegment(id="mark", line=LineSpec(start=(3.0, 30.0), end=(3.2, 30.0))),
    ),
    obstacles=(POST,),
)


def shared(options: PlanOptions, obstacle: Polygon = POST) -> SharedJob:
    template = TEMPLATE.model_copy(update={"obstacles": (obstacle,)})
    return share_reachable(template, options, Vehicle(), 2, lambda _done, _doing: None)


@pytest.mark.parametrize(
    ("obstacle", "parts", "most_m"),
    [(SHED, (), 16.0), pytest.param(POST, ("posted (1)", "posted (2)"), 3.0, marks=pytest.mark.full)],
)
def test_what_can_be_reached_is_shared_and_painted_and_the_rest_told(
    obstacle: Polygon, parts: tuple[str, ...], most_m: float
) -> None:
    job = shared(PlanOptions(), obstacle)
    (left,) = job.left_out
    assert (left.line_id, left.outline) == ("posted", obstacle.id)
    assert left.from_m < 8.0 < left.to_m
    names = [segment.id for share in job.shares for segment in share.segments]
    assert sorted(names) == ["mark", "north", *parts, "south"]
    assert job.figures()["left_out"]["total_m"] == left.length_m <= most_m
    outcome = simulate_shared(job, [Setup().with_seed(1 + number) for number in range(2)])
    assert outcome.reason == "" and outcome.work.metrics.verdict.accepted
    assert outcome.work.metrics.coverage_pct > 99.5


def test_where_nothing_can_be_reached_the_outlines_are_named() -> None:
    hall = Polygon(id="hall", corners=((-9.0, -9.0), (30.0, -9.0), (30.0, 40.0), (-9.0, 40.0)))
    with pytest.raises(PlanningError, match=r'no line that can be painted: everywhere .* would touch "hall"'):
        shared(PlanOptions(), hall)


def test_it_is_refused_if_that_is_asked_for() -> None:
    with pytest.raises(PlanningError, match=r'"posted" cannot be painted: the robot\'s body would touch "post"'):
        shared(PlanOptions(obstructed="refuse"))
