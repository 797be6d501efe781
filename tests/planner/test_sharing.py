"""Sharing a template among robots: every line once, about as long for each, and round each other's wet paint."""

import numpy as np
import pytest

from tests.planner.drawn import drawn
from touchline.schemas.catalogue import load_template
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.plan_task import Company, PlanTask
from touchline.services.planner.sequencing.wet_paint import BEGUN, SPEED, Wheels, wet_rows
from touchline.services.planner.sharing.shares import sharings
from touchline.services.planner.sharing.wet_between import Clocked, crossings_of

VEHICLE = Vehicle()


@pytest.mark.parametrize(("name", "robots"), [("tennis", 3), pytest.param("soccer-7", 4, marks=pytest.mark.full)])
def test_every_line_is_in_one_share_and_all_take_about_as_long(name, robots):
    template = load_template(name, {})
    ways = sharings(PlanTask(template, VEHICLE, PlanOptions()), robots)
    assert [way.cost_s for way in ways] == sorted(way.cost_s for way in ways)
    for way in ways:
        names = [segment.id for share in way.shares for segment in share.segments]
        assert sorted(names) == sorted(segment.id for segment in template.segments)
        assert len(way.shares) == robots and all(share.segments for share in way.shares)
    assert max(ways[0].seconds) <= 1.25 * sum(ways[0].seconds) / robots


def test_more_robots_than_swaths_are_refused():
    with pytest.raises(PlanningError, match="4 swaths, too few for 5 robots; give at most 4"):
        sharings(PlanTask(load_template("study-square", {}), VEHICLE, PlanOptions()), 5)


def test_areas_are_refused():
    with pytest.raises(PlanningError, match='the area "grass", and robots that paint share lines alone'):
        sharings(PlanTask(load_template("soccer-11-grass", {}), VEHICLE, PlanOptions()), 2)


def test_a_wet_line_of_another_robot_is_kept_off():
    """Two parallel lines with another robot's between them: the way round its end is taken, if it is worth it."""
    template = drawn((0.0, 0.0, 12.0, 0.0), (12.0, 6.0, 0.0, 6.0))
    painted = wet_rows([Curve.from_line((11.0, 3.0), (30.0, 3.0))])
    painted[:, BEGUN], painted[:, SPEED] = -100.0, 1.0
    options = PlanOptions(hard_drying=False)

    def met(company):
        made = plan(template, VEHICLE, options, company=company)
        return crossed(made, painted), made.report.total_time_s

    (alone, alone_s), (beside, beside_s) = met(Company()), met(Company(painted, 30.0))
    assert alone > 0 == beside and beside_s > alone_s


def crossed(made, painted):

    work = Clocked(made, lambda arc_m: np.array([made.speeds.time_at(float(s)) for s in np.atleast_1d(arc_m)]))
    return crossings_of(work, Wheels.of(VEHICLE, 0.12, 900.0), painted)
