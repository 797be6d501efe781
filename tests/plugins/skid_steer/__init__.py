"""A drive of somebody else with four actuators: two driven wheels on each side, which turn by skidding.

Nothing of Touchline knows it but by what is registered here.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from tests.plugins.skid_steer.onboard import OnboardSkidSteer
from tests.plugins.skid_steer.planned import PlannedSkidSteer
from tests.plugins.skid_steer.spec import SkidSteerDrive
from tests.plugins.skid_steer.world import SkidSteerInWorld
from touchline.schemas.plugins import DRIVES, KindParts


@contextmanager
def registered() -> Iterator[None]:
    """With the kind `skid-steer` among the drives."""
    parts = KindParts(SkidSteerDrive, planner=PlannedSkidSteer, onboard=OnboardSkidSteer, world=SkidSteerInWorld)
    DRIVES.register("skid-steer", "four driven wheels, which turn by skidding", parts)
    try:
        yield
    finally:
        DRIVES.forget("skid-steer")
