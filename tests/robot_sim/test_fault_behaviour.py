"""The robot's behaviour at every fault of the timeline, in the emulated world; random ones break no invariant."""

from __future__ import annotations

import pytest

from benchmarks._invariants import Guarded, fault, random_run
from tests.with_full import with_full
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.plugins import FAULTS

LOOK_TICKS = 20
"""While nothing has to be decided; `test_invariants` looks at every tick, and so does `python -m benchmarks safety`."""
DONE, PAUSED, ESTOPPED = TraversalStatus.DONE, TraversalStatus.PAUSED, TraversalStatus.ESTOPPED

# kind, parameters, words of the reason to stop ("" if it drives on), whether it goes on without an operator afterwards
# (None: that depends on how it went)
STOPS = [
    ("gnss-outage", {}, "GNSS has no fix", True),
    ("gnss-degraded", {"fix": "float"}, "a float fix", True),
    ("corrections-lost", {"duration_s": 20.0}, "", True),
    ("gnss-wrong-fix", {"east_m": 0.3}, "contradict", True),
    ("gnss-noisy", {"white_m": 0.2}, "the position is uncertain", True),
    ("gnss-noisy", {"white_m": 0.2, "honest": False}, "contradict", True),
    ("messages-late", {"sensor": "gnss", "delay_s": 0.8}, "no fix for more than 0.5 s", True),
    ("messages-late", {"sensor": "imu", "delay_s": 0.05}, "", True),
    ("messages-duplicated", {"sensor": "gnss"}, "", True),
    ("messages-reordered", {"sensor": "gnss", "spread_s": 0.25}, "", True),
    ("messages-lost", {"sensor": "gnss"}, "no fix for more than 0.5 s", True),
    ("messages-lost", {"sensor": "imu"}, "IMU's samples are older", True),
    ("messages-lost", {"sensor": "encoder"}, "encoders' samples are older", True),
    ("clock-skew", {"offset_s": 0.3}, "fix", True),
    ("imu-bias", {"gyro_radps": 0.05}, "contradict", None),
    ("imu-noisy", {}, "", True),
    ("imu-stuck", {}, "IMU's samples are older", None),
    ("encoder-dropout", {"actuator": "left"}, "left wheel does not turn", False),
    ("wheel-blocked", {}, "left wheel does not turn", False),
    ("wheel-slip", {"share": 0.5}, "wheels slip", None),
    ("motor-weak", {"share": 0.0}, "left wheel does not turn", False),
    ("valve-stuck", {"position": "open"}, "although the valve is closed", False),
    ("valve-stuck", {"position": "closed"}, "too little paint", False),
    ("nozzle-clogged", {"share": 0.7}, "too little paint", False),
    ("bumper", {}, "bumper is pressed", False),
    ("battery-low", {}, "battery is low", False),
    ("tank-empty", {}, "tank is empty", False),
    ("operator-lost", {}, "operator has not been heard", False),
]
HARMLESS = {
    "camera-outage": {},
    "camera-swapped": {},
    "magnetic-disturbance": {"east_t": 1e-5},
    "steering-offset": {},
    "disc-stuck": {"position": "up"},
    "nozzle-clogged": {"share": 0.9},
    "lidar-blind": {},
    "lidar-false-returns": {},
}
"""All at once; the robot has no camera, no lidar and no steering."""
OTHER_FIGURES = [
    ("gnss-degraded", {"fix": "float", "claimed_m": 0.02}, "a float fix", True),
    ("gnss-degraded", {"fix": "single"}, "a single fix", True),
    ("messages-late", {"sensor": "gnss", "delay_s": 0.2}, "", True),
    ("messages-late", {"sensor": "encoder", "delay_s": 0.05}, "", True),
    ("messages-lost", {"sensor": "magnetometer"}, "", True),
    ("nozzle-clogged", {"share": 0.3}, "too little paint", False),
]
"""More of the same kinds."""


def test_no_kind_is_left_out() -> None:
    assert {kind for kind, *_ in STOPS} | set(HARMLESS) == set(FAULTS.names())


@pytest.mark.parametrize(
    ("kind", "fields", "words", "by_itself"),
    with_full(*STOPS, full=OTHER_FIGURES),
    ids=[f"{kind}-{i}" for i, (kind, *_) in enumerate((*STOPS, *OTHER_FIGURES))],
)
def test_every_fault(kind: str, fields: dict[str, object], words: str, by_itself: bool | None) -> None:
    """Invariants hold, the reason is said, and nothing needs an operator that should not."""
    faults = (fault(kind, **{"start_s": 6.5, "duration_s": 4.0, **fields}),)
    run = Guarded(faults, seed=2, follower="pure-pursuit", patient=False, look_ticks=LOOK_TICKS)
    state = run.run(1600 if by_itself is False else 4500)
    reasons = run.reasons[1:]
    if not words:
        assert state == DONE and reasons == []
        return
    assert any(words in reason for reason in reasons), reasons
    if by_itself:
        assert state == DONE, reasons
    elif by_itself is False:
        assert state == (ESTOPPED if kind == "bumper" else PAUSED), reasons
    assert abs(run.emulator.onboard.estimate.speed_mps) < 0.02


def test_what_does_not_matter_stops_nobody() -> None:
    faults = tuple(fault(kind, start_s=6.5, duration_s=4.0, **fields) for kind, fields in HARMLESS.items())
    run = Guarded(faults, seed=2, follower="pure-pursuit", patient=False, look_ticks=LOOK_TICKS)
    assert (run.run(4500), run.reasons[1:]) == (DONE, [])


# Of the first 25 these have every kind of fault, every change of state with its reason, and every way to end.
@pytest.mark.parametrize("seed", with_full(8, 13, 24, full=(0, 6, 7, 10, 15, 16, 17, 20, 21, 23)))
def test_random_timelines_break_no_invariant(seed: int) -> None:
    random_run(seed, LOOK_TICKS).run(6000)
