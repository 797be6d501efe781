"""The robot's own computer: estimation, control, execution and safety, from sensor frames and nothing else."""

from touchline.onboard.computer import Onboard
from touchline.onboard.warm_up_drive import straight, warm_up

__all__ = ["Onboard", "straight", "warm_up"]
