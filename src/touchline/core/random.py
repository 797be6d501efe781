"""Counter-based randomness: every number is a pure function of (seed, stream, tick, channel).

Nothing is consumed in sequence, so adding a sensor or a fault changes no other noise, and any number can be
recomputed alone. The hash is the finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom
number generators", OOPSLA 2014) applied once per key word; normals come from the transform of G. E. P. Box and
M. E. Muller ("A note on the generation of random normal deviates", Annals of Mathematical Statistics 29(2), 1958).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from touchline.core.jit import kernel

STREAM_CHASSIS: Final = 1
STREAM_SLIP: Final = 2
STREAM_GNSS: Final = 3
STREAM_IMU: Final = 4
STREAM_MAGNETOMETER: Final = 5
STREAM_ENCODER: Final = 6
STREAM_RECEIVER: Final = 7  # fallback and convergence of a GNSS receiver, latency of its messages
STREAM_LOOSE_FIX: Final = 8  # errors of float and single positions
STREAM_TRANSPORT: Final = 9  # loss, delay and repetition of messages
STREAM_FAULT: Final = 10  # noise of faults
STREAM_CAMERA: Final = 11  # errors, gaps and delays of a camera's poses
STREAM_TEAM_START: Final = 12  # start poses of a team
STREAM_RADIO: Final = 13  # loss and delay of messages between a team's robots and its coordinator
STREAM_AUXILIARY: Final = 14  # of auxiliary sensors
STREAM_OBJECTS: Final = 15  # ways of objects that wander
STREAM_WANDER: Final = 16  # crab angle of the robot
STREAM_ROUGHNESS: Final = 17  # shape of the ground
STREAM_STAMP: Final = 18  # jitter of stamps
STREAM_BURST: Final = 19  # bursts of a receiver's errors, and the errors in them
STREAM_MULTIPATH: Final = 20  # maps of the errors at places
STREAM_VIBRATION: Final = 21  # vibration of the drive
STREAM_PATCHES: Final = 22  # map of the slip at places

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S30 = np.uint64(30)
_S27 = np.uint64(27)
_S31 = np.uint64(31)
_S11 = np.uint64(11)
_UNIT = 1.0 / 9007199254740992.0
_TWO_PI = 2.0 * math.pi


@kernel
def _mix(word: np.uint64) -> np.uint64:
    word = (word ^ (word >> _S30)) * _MIX_1
    word = (word ^ (word >> _S27)) * _MIX_2
    return word ^ (word >> _S31)


@kernel
def _hash(seed: int, stream: int, tick: int, channel: int) -> np.uint64:
    word = _mix(np.uint64(seed) + _GOLDEN)
    word = _mix((word ^ np.uint64(stream)) + _GOLDEN)
    word = _mix((word ^ np.uint64(tick)) + _GOLDEN)
    hashed: np.uint64 = _mix((word ^ np.uint64(channel)) + _GOLDEN)
    return hashed


@kernel
def whole(seed: int, counter: int, below: int) -> int:
    """Draw a whole number: the remainder of the top 53 bits of an output of SplitMix64.

    All are equally likely to within one part in 2⁵³ / `below`.

    Args:
        seed: Seed of SplitMix64.
        counter: Number of its outputs before this one.
        below: Upper bound, excluded; less than 1 counts as 1.

    Returns:
        0 … `below` − 1.
    """
    word = _mix(np.uint64(seed) + np.uint64(counter + 1) * _GOLDEN)
    return int((word >> _S11) % np.uint64(max(below, 1)))


@kernel
def uniform(seed: int, stream: int, tick: int, channel: int) -> float:
    """Draw from the uniform distribution on [0, 1): the top 53 bits of the key's hash.

    Args:
        seed: Seed of the session.
        stream: STREAM_CHASSIS to STREAM_PATCHES.
        tick: Tick of the draw.
        channel: Number within stream and tick.
    """
    return float(_hash(seed, stream, tick, channel) >> _S11) * _UNIT


@kernel
def normal(seed: int, stream: int, tick: int, channel: int) -> float:
    """Draw from the standard normal distribution. Finite for every key (|value| < 8.6).

    Args:
        seed: Seed of the session.
        stream: STREAM_CHASSIS to STREAM_PATCHES.
        tick: Tick of the draw.
        channel: Number within stream and tick.
    """
    word = _hash(seed, stream, tick, channel)
    radius_uniform = (float(word >> _S11) + 0.5) * _UNIT
    angle_uniform = float(_mix(word + _GOLDEN) >> _S11) * _UNIT
    return math.sqrt(-2.0 * math.log(radius_uniform)) * math.cos(_TWO_PI * angle_uniform)
