"""``touchline plan``: what it writes, and that it obeys its options."""

import json

import pytest

from touchline.schemas.messages import Trajectory


@pytest.fixture
def plan_of(touchline):
    """Output about the plan of a court."""

    def run(*options):
        code, out, err = touchline("plan", "tennis", *options, "--json")
        assert code == 0, err
        return json.loads(out)

    return run


def test_it_writes_what_it_is_asked_for(plan_of, tmp_path):
    out, report, plot = tmp_path / "t.json", tmp_path / "r.json", tmp_path / "p.svg"
    printed = plan_of("--out", str(out), "--report", str(report), "--plot", str(plot))
    assert json.loads(report.read_text()) == printed
    assert printed["continuity"]["position_gap_m"] < 1e-9
    trajectory = Trajectory.model_validate_json(out.read_text())
    assert len(trajectory.path.segments) > printed["segments"]["painted"]
    assert "<svg" in plot.read_text()


def test_it_orders_on_request(plan_of, touchline):
    free, given = (plan_of("--order", order) for order in ("optimised", "given"))
    assert free["time_s"]["total"] < given["time_s"]["total"]
    assert given["estimate"]["paint_l"] > 1.0
    code, _, err = touchline("plan", "soccer-7", "--hard-drying")
    assert code in (1, 2)
    assert "is wet" in err


def test_it_obeys_its_limits(plan_of):
    printed = plan_of("--kappa-max", "0.9", "--sigma-max", "1.0")
    assert printed["max"]["curvature_1pm"] <= 0.9 + 1e-9
    assert printed["max"]["sharpness_1pm2"] <= 1.0 + 1e-9
