"""Single messages say what the robot has."""

import numpy as np
import pytest

from touchline.onboard.protection.protection_zones import ProtectionZones
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import BatteryState, GnssStatus, NavSatFix, NavSatStatus, PolygonStamped
from touchline.services.robot_sim.packing import battery, gnss, header, zones
from touchline.services.robot_sim.sensors.gnss_truth import GnssReport


def said(fix, variance_m2=4e-4):
    report = GnssReport(12.345, 57.0, 9.9, 21.5, variance_m2, 16e-4, fix, 18, 1.5)
    (_, position), (_, status) = gnss(report)
    return decode(NavSatFix, position), decode(GnssStatus, status)


def test_a_position_with_its_covariance():
    position, status = said(GnssStatus.FIXED)
    assert (position.header.stamp.sec, position.header.stamp.nanosec) == (12, 345_000_000)
    assert (position.latitude, position.longitude, position.altitude) == (57.0, 9.9, 21.5)
    assert list(position.position_covariance) == [4e-4, 0, 0, 0, 4e-4, 0, 0, 0, 16e-4]
    assert position.position_covariance_type == NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    assert (status.fix, status.satellites, status.correction_age_s) == (GnssStatus.FIXED, 18, 1.5)
    assert status.horizontal_accuracy_m == pytest.approx((2 * 4e-4) ** 0.5)


def test_the_fix_and_its_status_go_together():
    kinds = {fix: said(fix)[0].status.status for fix in range(4)}
    assert kinds[GnssStatus.NONE] == NavSatStatus.STATUS_NO_FIX
    assert kinds[GnssStatus.SINGLE] == NavSatStatus.STATUS_FIX
    assert kinds[GnssStatus.FLOAT] == kinds[GnssStatus.FIXED] == NavSatStatus.STATUS_GBAS_FIX
    assert said(GnssStatus.NONE)[0].position_covariance_type == NavSatFix.COVARIANCE_TYPE_UNKNOWN


def test_a_battery_that_is_half_empty():
    message = decode(BatteryState, battery((1, 0), left_wh=340.0, power_w=75.0, capacity_wh=680.0))
    assert message.percentage == pytest.approx(0.5)
    assert message.voltage == pytest.approx(37.5)
    assert message.current == pytest.approx(-2.0), "negative while it gives: 75 W at 37.5 V"
    assert message.charge / message.design_capacity == pytest.approx(0.5)
    assert message.design_capacity == pytest.approx(680.0 / 37.0)


def test_zones_are_outlines_in_the_map_frame():
    found = ProtectionZones(
        np.array([(1.0, 2.0), (3.0, 2.0), (2.0, 4.5)]), np.array([(0.0, 0.0), (5.0, 0.0), (5.0, 9.0)])
    )
    packed = dict(zones(1234, found))
    assert list(packed) == [topics.STOP_ZONE, topics.SLOW_ZONE]
    for topic, outline in zip(packed, found, strict=True):
        message = decode(PolygonStamped, packed[topic])
        assert message.header == header(1234) and encode(message) == packed[topic]
        assert [(point.x, point.y, point.z) for point in message.polygon.points] == [(x, y, 0.0) for x, y in outline]
