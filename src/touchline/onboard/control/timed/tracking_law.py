"""Common parts of the tracking laws: the errors, the reference, and the call of a law by kernels.

A law is a named tuple of its gains; the class of that tuple has the kernel `steer`, so that code is compiled for the
law at hand (`touchline.core.jit.kernel_of_class`).

The errors are those of B. Siciliano, L. Sciavicco, L. Villani and G. Oriolo, "Robotics: Modelling, Planning and
Control", Springer 2009, sec. 11.6: with v = v_d·cos e₃ − u₁ and ω = ω_d − u₂,

    ė₁ = ω·e₂ + u₁        ė₂ = v_d·sin e₃ − ω·e₁        ė₃ = u₂
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel_of_class

Floats = NDArray[np.float64]

LAW_MEMORY: Final = 1
"""Numbers that a law may keep from tick to tick; all 0 when a motion begins."""


class TrackingErrors(NamedTuple):
    """Errors of the robot against the reference, in the robot's frame.

    Attributes:
        along_m: e₁, distance of the reference ahead.
        across_m: e₂, distance to the left.
        turn_rad: e₃, its heading less the robot's, in (−π, π].
    """

    along_m: float
    across_m: float
    turn_rad: float


class Wanted(NamedTuple):
    """Motion of the reference.

    Attributes:
        speed_mps: v_d, negative when it is driven backward.
        yaw_rate_radps: ω_d.
        acceleration_mps2: Derivative of v_d.
    """

    speed_mps: float
    yaw_rate_radps: float
    acceleration_mps2: float = 0.0


@kernel_of_class
def steer(law: Any, errors: TrackingErrors, wanted: Wanted, memory: Floats) -> tuple[float, float]:
    """Compute the twist by a tracking law.

    Args:
        law: Gains of the law.
        errors: Present errors.
        wanted: Motion of the reference.
        memory: (LAW_MEMORY,) updated.

    Returns:
        Speed [m/s] and yaw rate [rad/s] of the body.
    """
    raise NotImplementedError
