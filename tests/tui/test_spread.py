"""The ellipse of the robot's position: from its covariance, on the map, and in the panel."""

import math

import numpy as np
import pytest

from tests.tui import scenes
from tests.tui.console import console, plain
from tests.tui.scenes import received
from touchline.schemas import topics
from touchline.tui.map_raster import Ink, MapRaster, MapScene
from touchline.tui.panels import StatusPanel
from touchline.tui.robot import ShownPose
from touchline.tui.spread import Spread
from touchline.tui.viewport import Viewport


def covariance(long_m: float, short_m: float, angle_rad: float) -> np.ndarray:
    """(36,) of a pose whose standard deviations along and across a direction are these."""
    turn = np.array([[math.cos(angle_rad), -math.sin(angle_rad)], [math.sin(angle_rad), math.cos(angle_rad)]])
    full = np.zeros((6, 6))
    full[:2, :2] = turn @ np.diag([long_m**2, short_m**2]) @ turn.T
    return full.ravel()


@pytest.mark.parametrize("angle_rad", [0.0, 0.4, math.pi / 2, -1.2])
def test_semi_axes_are_three_standard_deviations(angle_rad):
    spread = Spread.of(covariance(0.4, 0.1, angle_rad))
    assert spread is not None
    assert (spread.long_m, spread.short_m) == pytest.approx((1.2, 0.3))
    assert math.remainder(spread.angle_rad - angle_rad, math.pi) == pytest.approx(0.0, abs=1e-9)
    ring = spread.outline(5.0, -2.0)
    offset = np.stack((ring.x_m - 5.0, ring.y_m + 2.0))
    inverse = np.linalg.inv(covariance(0.4, 0.1, angle_rad).reshape(6, 6)[:2, :2])
    assert np.einsum("in,ij,jn->n", offset, inverse, offset) == pytest.approx(np.full(len(ring), 9.0))


@pytest.mark.parametrize(
    "wrong", [np.zeros(36), np.full(36, math.nan), np.full(36, math.inf), -np.eye(6).ravel(), np.eye(6)[::-1].ravel()]
)
def test_what_is_no_covariance_tells_nothing(wrong):
    assert Spread.of(wrong) is None


def test_it_is_drawn_once_it_is_larger_than_a_cell():
    view = Viewport(40, 20, dot_m=0.5)
    robot = ShownPose(0.0, 0.0, 0.0)

    def body_cells(long_m: float) -> int:
        scene = MapScene(robot=robot, spread=Spread(long_m, long_m, 0.0))
        return int((MapRaster().compose(view, scene).inks == Ink.BODY).sum())

    assert body_cells(0.49) == 0
    assert body_cells(4.0) >= 8


async def test_the_panel_has_its_size():
    odometry = scenes.odometry(1.0, 2.0, 0.0)
    pose = odometry.pose.model_copy(update={"covariance": covariance(0.04, 0.01, 0.3)})
    told = received(topics.ODOMETRY, odometry.model_copy(update={"pose": pose}))
    async with console(*scenes.standing(), told) as (app, link, pilot):
        assert "within   12 cm × 30 mm (3σ)" in plain(app, StatusPanel)
        link.incoming.append(received(topics.ODOMETRY, odometry))
        app.tick()
        await pilot.pause()
        assert "3σ" not in plain(app, StatusPanel)
