"""From a scan to hits: each beam at its own time, without the robot's body, ground, rain and dropouts."""

import math

import numpy as np
import pytest

from benchmarks._lidar_scene import Floats, Scene, Seeing, box, legs, standing, still
from touchline.onboard.interface import AuxiliarySample
from touchline.onboard.perception.scan import NOTHING, UNUSABLE
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.schemas.vehicles.protection import Protection

EXACT = LidarSpec(name="front", sigma_m=0.0, systematic_m=0.0)
POST = (3.0, 1.0, 0.06)


def robot(lidar: LidarSpec = EXACT, **rules: object) -> Vehicle:
    return Vehicle(sensors=(lidar,), protection=Protection.model_validate(rules))


def hits(seeing: Seeing) -> Floats:
    found = seeing.perception.hits
    assert found is not None
    return found.points_m


def seen(seeing: Seeing, scans: int) -> Floats:
    """Return the hits after a number of scans."""
    for _ in range(scans):
        seeing.scan()
    return hits(seeing)


def from_post(points: Floats) -> Floats:
    return np.abs(np.hypot(*(points - POST[:2]).T) - POST[2])


@pytest.mark.parametrize("turn_radps", [0.0, 2.0])
def test_a_post_stays_in_place_while_the_robot_drives_and_turns(turn_radps: float) -> None:
    seeing = Seeing(robot(), lambda t: (-2.0 + 1.4 * (t - 0.64), 0.0, turn_radps * t), still([POST]))
    for _ in range(12):
        points = seen(seeing, 1)
        assert len(points) > 0
        assert from_post(points).max() < 0.002


def test_the_robots_body_and_what_is_too_near_are_no_hits() -> None:
    arm, inside_range = (0.0, -0.45, 0.02), (0.02, 0.0, 0.01)
    seeing = Seeing(robot(), standing(), still([arm, inside_range]))
    assert len(seen(seeing, 3)) == 0
    (lidar,) = seeing.perception._lidars.values()
    assert (lidar.beams.kind == UNUSABLE).any()


def test_a_range_that_is_not_a_number_is_no_hit_and_no_free_ground() -> None:
    seeing = Seeing(robot(), standing(), still())
    sample = seeing.sample()
    seeing.perception.take(sample._replace(values=(math.nan, -1.0, *sample.values[2:])), seeing.estimator)
    (lidar,) = seeing.perception._lidars.values()
    assert lidar.beams.kind[:3].tolist() == [UNUSABLE, UNUSABLE, NOTHING]


def test_beams_without_a_return_are_placed_for_who_reads_whole_scans() -> None:
    seeing = Seeing(robot(), lambda t: (0.5 * t, 0.0, 0.0), still([POST]))
    seeing.perception.whole_scans = True
    for _ in range(3):
        seeing.scan()
        ((_, beams),) = seeing.perception.scans
        assert (beams.kind == NOTHING).sum() > 100
        np.testing.assert_allclose(np.hypot(*beams.rays[:, 2:].T), 1.0)
        assert np.ptp(beams.rays[:, 0]) < 0.06
        assert beams.rays[0, 0] == pytest.approx(beams.rays[-1, 0], abs=0.06)


def test_of_scans_without_any_return_as_much_is_kept_as_if_they_were_gone_through() -> None:
    def passes(time_s: float) -> Scene:
        return Scene(legs(time_s - 3.0, 4.0, 0.0, 6.0 * time_s)) if time_s % 3.0 > 2.5 else Scene()

    brief, full = (Seeing(robot(), standing(), passes) for _ in range(2))
    brief.dropout = full.dropout = 0.1
    for _ in range(67):
        full.perception._tracks.none = False  # there might be one, so it goes through the scan
        brief.scan()
        full.scan()
        found, wanted = brief.perception.hits, full.perception.hits
        assert found is not None and wanted is not None and found[1:4] == wanted[1:4]
        np.testing.assert_array_equal(found.points_m, wanted.points_m)
        ours, theirs = brief.perception.tracks, full.perception.tracks
        assert [each[:-1] for each in ours] == [each[:-1] for each in theirs]
        kept, wanted_too = (
            (*each.perception._lidars["front"].memory, *each.perception._past) for each in (brief, full)
        )
        for array, wanted_array in zip(kept, wanted_too, strict=True):
            np.testing.assert_array_equal(array, wanted_array)
    assert brief.perception._tracks.none and full.perception._tracks._numbers[0] > 1


def test_a_scan_with_another_number_of_beams_is_refused_with_both() -> None:
    seeing = Seeing(robot(), standing(), still())
    sample = seeing.sample()
    with pytest.raises(ValueError, match=r"front: 3 ranges in a scan; its data sheet has beams: 720"):
        seeing.perception.take(sample._replace(values=(1.0, 1.0, 1.0)), seeing.estimator)


@pytest.mark.parametrize("late_s", [0.6, -0.02])
def test_a_scan_from_before_the_estimators_memory_or_from_the_future_is_not_used(late_s: float) -> None:
    seeing = Seeing(robot(), standing(), still([POST]))
    sample = seeing.sample()
    seeing.perception.take(sample._replace(stamp_s=sample.stamp_s - late_s), seeing.estimator)
    assert seeing.perception.hits is None
    assert seeing.perception.too_late == 1


def test_ahead_of_a_nose_that_is_low_the_ground_is_doubtful_and_a_post_before_it_is_not() -> None:
    low = EXACT.model_copy(update={"pitch_rad": math.radians(5.0)})
    ground_m = low.height_m / math.sin(low.pitch_rad)
    ground = box(ground_m, -1.0, 0.01, 2.0)  # a wall where ahead of the robot the plane cuts the ground
    seeing = Seeing(robot(low), standing(), lambda _t: Scene(walls=ground))
    assert len(seen(seeing, 4)) == 0
    found = seeing.perception.hits
    assert found is not None
    assert len(found.doubtful_m) > 50
    nearer = Seeing(robot(low), standing(), still([(1.0, 0.0, 0.05)], ground))
    assert np.hypot(*(seen(nearer, 1) - (1.0, 0.0)).T).max() < 0.06


def test_ground_that_moves_along_stays_doubtful_and_what_stays_put_becomes_a_hit() -> None:
    low = EXACT.model_copy(update={"pitch_rad": math.radians(5.0)})
    ground_m = low.height_m / math.sin(low.pitch_rad)

    def driving(time_s: float) -> tuple[float, float, float]:
        return 1.0 * time_s, 0.0, 0.0

    along = Seeing(robot(low), driving, lambda t: Scene(walls=box(driving(t)[0] + ground_m, -0.3, 0.01, 0.6)))
    put = Seeing(robot(low), driving, still([(4.2, 0.0, 0.2)]))
    for _ in range(15):
        assert len(seen(along, 1)) == 0
    assert len(seen(put, 15)) > 0
    assert math.hypot(put.perception._place[0] - 4.2, 0.0) > 1.9  # while it was still within the doubtful ranges


def test_at_the_foot_of_a_slope_the_level_ground_ahead_is_doubtful() -> None:
    seeing = Seeing(robot(), standing(), lambda _t: Scene(walls=box(2.0, -0.2, 0.01, 0.4)))
    seeing.estimator.ring.learned.rise_east_mps2 = -9.81 * 0.09  # downhill, to the east
    assert len(seen(seeing, 3)) == 0


@pytest.mark.parametrize(("per_beam", "within_m", "most"), [(0.001, 2.0, 2), (0.002, 8.0, 2)])
def test_rain_is_no_hit_and_a_post_is(per_beam: float, within_m: float, most: int) -> None:
    seeing = Seeing(robot(), standing(), still([(8.0, 0.0, 0.1)]))
    seeing.rain, seeing.rain_m, seeing.dropout = per_beam, within_m, 0.05
    seen(seeing, 2)  # before these it has not seen that there is nothing
    posts, false = 0, 0
    for _ in range(60):
        points = seen(seeing, 1)
        at_post = np.hypot(*(points - (8.0, 0.0)).T) < 0.2
        posts += bool(at_post.any())
        false += int((~at_post).sum())
    assert posts >= 58
    assert false <= most  # of about 40 and 80 drops


def after_two_scans(thing: tuple[float, float, float], walls: Floats | None = None) -> Seeing:
    """Return a standing robot that has looked round twice before a thing comes."""
    before, then = still(walls=walls), still([thing], walls)

    def scene_at(time_s: float) -> Scene:
        return (before if seeing.scans < 3 else then)(time_s)

    seeing = Seeing(robot(), standing(), scene_at)
    seen(seeing, 2)
    return seeing


@pytest.mark.parametrize(("radius_m", "scans"), [(0.05, 1), (0.004, 3)])
def test_a_thing_near_by_counts_in_its_first_scan_and_one_of_a_single_beam_in_its_third(
    radius_m: float, scans: int
) -> None:
    seeing = after_two_scans((1.2, 0.0, radius_m))
    assert [bool(len(seen(seeing, 1))) for _ in range(scans)] == [*[False] * (scans - 1), True]


def test_one_of_a_single_beam_counts_at_once_in_the_first_scan_or_where_something_hid_it() -> None:
    assert len(seen(Seeing(robot(), standing(), still([(1.2, 0.0, 0.004)])), 1)) > 0
    hidden = after_two_scans((1.2, 0.56, 0.004), box(1.0, -0.5, 0.05, 0.95))
    assert (np.hypot(*(seen(hidden, 1) - (1.2, 0.56)).T) < 0.03).any()


def test_what_is_outside_the_sector_of_one_lidar_is_looked_through_by_another() -> None:
    halves = [EXACT.model_copy(update={"name": str(at), "first_rad": at, "beams": 361}) for at in (-1.5708, 1.5708)]
    false = []
    for lidars in (halves, halves[:1]):
        seeing = Seeing(Vehicle(sensors=(halves[0],)), standing(), still())
        seeing.perception, seeing.rain = type(seeing.perception)(Vehicle(sensors=tuple(lidars))), 0.003
        false.append(0)
        for scan in range(100):
            for seeing.lidar in lidars:
                seeing.scan()
            false[-1] += len(hits(seeing)) if scan > 1 else 0
    both, one = false
    assert both < 8 < one  # of about 200 and 100 drops; at the edge of a blind sector each may be a thing


def test_how_near_is_near_grows_with_speed() -> None:
    near = [Seeing(robot(), standing(), still()).perception._near_m(v, 0.0, EXACT) for v in (0.0, 1.0)]
    assert 1.0 < near[0] < near[1] < 10.0
    things_stand = Seeing(robot(thing_speed_mps=0.0), standing(), still()).perception
    assert things_stand._near_m(1.0, 0.0, EXACT) < near[1]


def test_a_post_that_a_scan_misses_stays_for_that_scan_and_one_that_is_gone_goes() -> None:
    seeing = Seeing(robot(), standing(), still([POST]))
    seen(seeing, 3)
    for count in (1, 0):
        sample = seeing.sample()
        seeing.perception.take(sample._replace(values=(math.inf,) * 720), seeing.estimator)
        assert bool(len(hits(seeing))) == bool(count)
    seen(seeing, 3)
    sample = seeing.sample()
    seeing.perception.take(sample._replace(values=(6.0,) * 720), seeing.estimator)  # seen through: there is a wall
    assert not (from_post(hits(seeing)) < 0.2).any()


def test_hits_of_two_lidars_are_joined_and_there_are_none_until_both_have_scanned() -> None:
    front = EXACT.model_copy(update={"beams": 361, "first_rad": -math.pi / 2.0})
    rear = front.model_copy(update={"name": "rear", "first_rad": math.pi / 2.0, "x_m": -0.3})
    seeing = Seeing(Vehicle(sensors=(front,)), standing(), still([POST, (-2.0, 0.0, 0.1)]))
    both = Vehicle(sensors=(front, rear))
    seeing.perception = type(seeing.perception)(both)
    for _ in range(2):
        seeing.scan()
    assert seeing.perception.hits is None
    seeing.lidar = rear
    for _ in range(2):
        seeing.scan()
    points = hits(seeing)
    assert (points[:, 0] > 2.0).any()
    assert (points[:, 0] < -1.0).any()


def test_the_bound_covers_noise_bearing_and_pose() -> None:
    noisy = LidarSpec(name="front", sigma_m=0.02, systematic_m=0.0)
    wall = box(1.0, -2.0, 0.1, 4.0)
    seeing = Seeing(robot(noisy), standing(), still(walls=wall))
    seeing.pose_sigma = (0.02, math.radians(0.3))
    worst, bound = 0.0, 0.0
    for _ in range(20):
        points = seen(seeing, 1)
        found = seeing.perception.hits
        assert found is not None
        bound = found.error_m
        worst = max(worst, float(np.percentile(np.abs(points[np.abs(points[:, 1]) < 1.0, 0] - 1.0), 99.0)))
    assert worst < bound < 0.3


def test_unseen_ground_is_bounded_by_points_a_decimetre_apart_behind_things_and_beside_the_field() -> None:
    field = LidarSpec(name="front", first_rad=-2.35, beams=540, sigma_m=0.0, systematic_m=0.0)
    bench = box(2.0, -0.5, 0.4, 1.0)
    points = seen(Seeing(robot(field, unseen="occupied"), standing(), still(walls=bench)), 2)
    for bearing in (-2.35, math.atan2(0.5, 2.0), math.atan2(-0.5, 2.0)):
        from_m = 0.06 if bearing < -2.0 else 2.2
        edge = [(r * math.cos(bearing), r * math.sin(bearing)) for r in np.arange(from_m, 3.9, 0.05)]
        apart = [np.hypot(*(points - place).T).min() for place in edge]
        assert max(apart) < 0.08
    ignored = seen(Seeing(robot(field), standing(), still(walls=bench)), 2)
    assert np.hypot(*ignored.T).max() < 2.2


def test_a_sample_of_another_sensor_is_not_its_own() -> None:
    perception = Seeing(robot(), standing(), still()).perception
    assert perception.takes(AuxiliarySample("front", 0.0, ()))
    assert not perception.takes(AuxiliarySample("rear", 0.0, ()))
