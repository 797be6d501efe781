"""The robot's own computer: estimation, control, execution and safety, with sensor frames as the only input."""

from touchline.onboard.computer import Onboard
from touchline.onboard.warm_up_drive import straight, warm_up

__all__ = ["Onboard", "straight", "warm_up"]
