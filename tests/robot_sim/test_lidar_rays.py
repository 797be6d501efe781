"""Ranges of a lidar's scan: every beam as a test against every thing finds it, at rest and under way."""

import math

import numpy as np

from touchline.schemas.lidar_truth import LidarTruth
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.services.robot_sim.sensors.auxiliary_truth import Draw
from touchline.services.robot_sim.sensors.lidar_in_world import LidarInWorld
from touchline.services.robot_sim.sensors.lidar_scan import see
from touchline.services.robot_sim.sensors.rays import range_to_disc, range_to_edge
from touchline.services.robot_sim.world.objects import things as t
from touchline.services.robot_sim.world.objects.solids import DARK, HEIGHT, RADIUS, X1, X2, Y1, Y2
from touchline.services.robot_sim.world.objects.surroundings import Surroundings

TICK = 1000


def scattered(rng, count, half_m=30.0):
    """Posts, benches and people in a square round the origin."""
    objects = []
    for _ in range(count):
        kind = ("post", "bench", "wall", "person", "goal", "grass")[int(rng.integers(6))]
        x, y = rng.uniform(-half_m, half_m, 2).tolist()
        objects.append({"kind": kind, "x_m": x, "y_m": y, "heading_rad": float(rng.uniform(-3, 3))})
    return Scenario(objects=objects)


def mounted(surroundings, spec, silent=True, **truth):
    """A lidar among things, without errors unless it is not `silent`."""
    sensor = LidarInWorld(spec, LidarTruth(**truth), Draw(1, 1 << 16, silent))
    sensor.surroundings = surroundings
    return sensor


def brute_force(lidar, things):
    """Ranges of the last scan by a test of every beam against every thing."""
    figures, scan = lidar._figures, lidar._arrays
    ranges, dark = np.full(len(scan.rays), math.inf), np.zeros(len(scan.rays))
    seen = [(row, row[HEIGHT], row[DARK], None) for row in things.grid.solids]
    for mover, own in zip(things.movers, things.figures, strict=True):
        row = np.zeros(7)
        row[X1], row[Y1], row[RADIUS] = mover[t.EAST], mover[t.NORTH], own[t.M_RADIUS]
        seen.append((row, own[t.M_HEIGHT], own[t.M_DARK], mover))
    for row, height, is_dark, mover in seen:
        for beam, ray in enumerate(scan.rays):
            x, y = row[X1], row[Y1]
            if mover is not None:
                x = x - mover[t.EAST_MPS] * scan.age_s[beam]
                y = y - mover[t.NORTH_MPS] * scan.age_s[beam]
            met = range_to_disc(ray, x, y, row[RADIUS]) if row[RADIUS] else range_to_edge(ray, *row[[X1, Y1, X2, Y2]])
            if met < ranges[beam] and figures.height_m - scan.drop[beam] * met <= height:
                ranges[beam], dark[beam] = met, is_dark
    most = np.where(dark > 0, figures.dark_m, figures.max_m)
    ranges[ranges > most] = math.inf
    return ranges


def test_every_beam_is_as_by_brute_force():
    rng = np.random.default_rng(7)
    spec = LidarSpec(name="front", beams=91, step_rad=2 * math.pi / 91, x_m=0.4, y_m=0.1)
    for moving in (False, True) * 3:
        around = Surroundings(Vehicle(), scattered(rng, 40, half_m=float(rng.uniform(2, 30))), 0.0)
        lidar, things = mounted(around, spec), around.things
        pose, twist = rng.uniform(-3, 3, 3), rng.uniform(-2, 2, 3) * moving
        for back in range(t.POSES):
            things.trail[(TICK - back) % t.POSES] = pose - twist * 0.01 * back
        things.movers[:, [t.EAST_MPS, t.NORTH_MPS]] = rng.uniform(-2, 2, (len(things.movers), 2)) * moving
        see(lidar._figures, lidar._arrays, things, TICK)
        wanted = brute_force(lidar, things)
        assert np.array_equal(lidar._arrays.ranges, wanted)
        assert np.isfinite(wanted).any()
