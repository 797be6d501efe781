"""Wet paint that wheels and casters carry away: cases worked out by hand, a raster, and the plan's own count."""

import math

import numpy as np
import pytest

from tests.robot_sim.strokes import EASTWARD, WIDTH, ledger_of, line, paint
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.paint import smears
from touchline.services.robot_sim.paint.contact import FAINTEST
from touchline.services.robot_sim.paint.smears import smearing
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.telemetry import Telemetry

SIDE_M, WHEEL_M, TREAD_M = 0.25, 0.1, 0.08
LEFT_ONLY = {"casters_m": [], "track_width_m": 2 * SIDE_M, "wheel_width_m": TREAD_M}
ROUND_M = 2 * math.pi * WHEEL_M


def vehicle(drive=None, **tool):
    return Vehicle.model_validate({"drive": LEFT_ONLY | (drive or {}), "tool": {"drying_time_s": 60.0} | tool})


def painted(*ways):
    """A ledger of an eastward line, and a track that waits far to the south while it is painted, from 0 to 10 s."""
    ledger, track = ledger_of(EASTWARD), Track()
    track.enter(0, (50.0, -50.0, 0.0), 0)
    paint(ledger, line((0.0, 0.0), (10.0, 0.0)))
    track.enter(1000, (50.5, -50.0, 0.0), ledger.points)
    for begun_s, poses in ways:
        for index, pose in enumerate(poses):
            track.enter(round(100 * begun_s) + index, pose, ledger.points)
    return ledger, track


def northward(x, first=-3.0, last=5.0, heading=math.pi / 2):
    return [(x, y, heading) for y in np.arange(first, last, 0.01)]


def of_the_left_wheel(found, x=5.0):
    return [smear for smear in found.smears if abs(smear.points[0, 0] - (x - SIDE_M)) < 0.02]


def test_a_wheel_prints_each_time_that_its_tread_comes_round():
    """Over the line at (4.75, 0), painted 4.75 s after the start, 10 s later."""
    at_line_s = 14.75
    ledger, track = painted((at_line_s - 3.0, northward(5.0)))
    found = smearing(ledger, track, vehicle())
    assert found.crossings == 2  # the other wheel is over (5.25, 0)
    assert found.youngest_s == pytest.approx(9.5, abs=0.1)
    prints = of_the_left_wheel(found)
    taken = 0.5 * (1 - 10.0 / 60.0)
    assert len(prints) == sum(taken * math.exp(-n * ROUND_M) >= FAINTEST for n in range(1, 20)) == 3
    for turn, smear in enumerate(prints, 1):
        assert smear.line == 0
        assert smear.width_m == TREAD_M
        assert smear.age_s == pytest.approx(10.0, abs=0.1)
        assert smear.strength == pytest.approx(taken * math.exp(-turn * ROUND_M), rel=0.01)
        assert smear.points[0] == pytest.approx((4.75, turn * ROUND_M - WIDTH / 2), abs=0.006)
        assert smear.points[-1] == pytest.approx((4.75, turn * ROUND_M + WIDTH / 2), abs=0.006)
    assert found.area_m2 == pytest.approx(2 * 3 * WIDTH * TREAD_M, rel=0.08)


def test_what_is_dry_stays_where_it_is():
    ledger, track = painted((80.0, northward(5.0)))
    assert smearing(ledger, track, vehicle()) == (0, 0.0, 0.0, [])
    assert smearing(ledger, track, vehicle(drying_time_s=100.0)).crossings == 2


def test_paint_that_does_not_stick_is_crossed_all_the_same():
    ledger, track = painted((11.75, northward(5.0)))
    found = smearing(ledger, track, vehicle(smear_share=0.0))
    assert found.crossings == 2
    assert (found.area_m2, found.smears) == (0.0, [])


def test_paint_that_comes_later_is_not_met():
    ledger, track = ledger_of(EASTWARD), Track()
    for index, pose in enumerate(northward(5.0)):
        track.enter(index, pose, 0)
    paint(ledger, line((0.0, 0.0), (10.0, 0.0)))
    track.enter(3000, (50.0, -50.0, 0.0), ledger.points)
    assert smearing(ledger, track, vehicle()).crossings == 0


def test_a_wheel_that_turns_back_prints_where_it_has_not_been():
    """0.3 m beyond the line it reverses: the tread that met the line comes round again 0.63 m behind it."""
    poses = northward(5.0, -0.5, 0.3)
    ledger, track = painted(
        (12.0, poses + [(x, y, h) for x, y, h in reversed(poses)] + northward(5.0, -2.0, -0.5)[::-1])
    )
    found = smearing(ledger, track, vehicle())
    assert found.crossings == 4
    prints = of_the_left_wheel(found)
    assert prints
    assert all(smear.points[:, 1].max() < -0.5 for smear in prints)
    middle = np.mean(prints[0].points[[0, -1], 1])
    assert middle == pytest.approx(-ROUND_M, abs=0.01)


def test_a_caster_always_rolls_forward():
    poses = northward(5.0, -2.0, 3.0, heading=-math.pi / 2)
    fields = {"casters_m": [[0.0, 0.0]], "caster_radius_m": 0.1, "caster_width_m": TREAD_M}
    ledger, track = painted((13.0, poses))
    found = smearing(ledger, track, vehicle(fields))
    for x in (4.75, 5.0, 5.25):
        (first, *_) = [smear for smear in found.smears if abs(smear.points[0, 0] - x) < 0.02]
        assert np.mean(first.points[[0, -1], 1]) == pytest.approx(ROUND_M, abs=0.01)


def test_a_raster_finds_the_same_area():
    """Askew and curved over a line, prints over prints; cells of 2 mm, in a way of its own."""
    poses = [(5.0 + math.sin(a), 0.4 - math.cos(a), a) for a in np.linspace(0.0, 7.0, 600)]
    ledger, track = painted((11.0, poses))
    robot = vehicle(smear_length_m=3.0)
    found = smearing(ledger, track, robot)
    assert found.crossings >= 3
    cell = 0.002
    xs, ys = np.arange(3.0, 7.0, cell), np.arange(-2.0, 3.0, cell)
    x, y = np.meshgrid(xs, ys)
    touched = np.zeros(x.shape, dtype=bool)
    for smear in found.smears:
        for a, b in zip(smear.points[:-1], smear.points[1:], strict=True):
            (ex, ey), length = b - a, math.dist(a, b)
            low, high = np.minimum(a, b) - TREAD_M, np.maximum(a, b) + TREAD_M
            near = slice(*np.searchsorted(ys, (low[1], high[1]))), slice(*np.searchsorted(xs, (low[0], high[0])))
            s = ((x[near] - a[0]) * ex + (y[near] - a[1]) * ey) / length
            left = ((y[near] - a[1]) * ex - (x[near] - a[0]) * ey) / length
            touched[near] |= (s >= 0.0) & (s <= length) & (np.abs(left) <= TREAD_M / 2)
    touched &= (np.abs(y) > WIDTH / 2) | (x < 0.0) | (x > 10.0)
    assert found.area_m2 == pytest.approx(touched.sum() * cell**2, rel=0.02)


def test_the_drive_meets_wet_paint_as_often_as_the_plan_says():
    """Without noise; a grid whose bars nobody can paint without running over one of the others."""
    bars = [{"id": f"v{x}", "line": {"start": (x, -2), "end": (x, 2)}} for x in (0, 3)]
    bars += [{"id": f"h{y}", "line": {"start": (-2, y), "end": (5, y)}} for y in (-1, 1)]
    template = Template.model_validate({"name": "grid", "line_width_m": 0.12, "segments": bars})
    planned = plan(template, Vehicle(), PlanOptions())
    emulator = Emulator(Vehicle(), Scenario(noise="none"))
    emulator.load(planned.trajectory, template)
    emulator.start()
    FastRunner(emulator).run(1_000_000)
    report = Telemetry(emulator).reports().traversal
    assert report.wet_crossings == planned.report.wet_crossings > 0
    assert report.smears
    assert report.smeared_m2 > 0.0
    assert 0.0 < report.wet_youngest_s < report.total_time_s
    assert report.coverage_pct > 99.9


def test_the_report_of_a_stopped_traversal_is_of_then_though_the_robot_goes_on():
    line = {"id": "a", "line": {"start": (0, 0), "end": (8, 0)}}
    template = Template.model_validate({"name": "line", "line_width_m": 0.12, "segments": [line]})
    emulator = Emulator(Vehicle(), Scenario(noise="none"))
    telemetry, runner = Telemetry(emulator, report_at_once=False), FastRunner(emulator)
    emulator.load(plan(template, Vehicle(), PlanOptions()).trajectory, template)
    emulator.start()
    while emulator.work.ledger.coverage_pct < 40.0:
        runner.run(10)
    emulator.estop()
    while telemetry.ended is None:
        runner.step(1, telemetry.rows)
        telemetry.after_tick()
    then = telemetry.ended.reports()  # made by a thread, sooner or later
    emulator.reset()
    emulator.resume()
    while emulator.work.ledger.coverage_pct < 80.0:
        runner.run(10)
    assert telemetry.ended.reports() == then
    assert 40.0 < then.traversal.coverage_pct < 60.0


def test_a_long_way_of_prints_has_room(monkeypatch):
    ledger, track = painted((11.75, northward(5.0)))
    known = smearing(ledger, track, vehicle())
    monkeypatch.setattr(smears, "_ROOM", 7)
    assert len(smearing(ledger, track, vehicle()).smears) == len(known.smears)
