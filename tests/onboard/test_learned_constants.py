"""Constants that differ from the robot's files: when the filter is certain of it."""

import numpy as np
import pytest

from touchline.onboard.estimation.learned_constants import note_differences
from touchline.onboard.filter_model import STAMP_OFFSET, STATES, VARYING, FilterCounters

CALM = {"fix_unrest": 0.5, "encoders": 1000}
STAMPS = 1 << STAMP_OFFSET - VARYING


def noted(sigmas, **counted):
    """Constants that are noted if the stamp offset differs by 30 ms, which is so many σ."""
    x, counters = np.zeros(STATES), FilterCounters(**counted)
    x[STAMP_OFFSET] = 0.03
    note_differences(x, (0.03 / sigmas) ** 2 * np.eye(STATES), counters.array[0])
    return counters.differing


@pytest.mark.parametrize(
    ("sigmas", "changed", "found"),
    [
        (6.0, {}, STAMPS),
        (5.0, {}, 0),
        (6.0, {"fix_unrest": 4.0}, 0),
        (12.0, {"fix_unrest": 4.0}, STAMPS),
        (12.0, {"fix_unrest": 0.0}, 0),
        (12.0, {"inconsistent": True}, 0),
        (12.0, {"encoders_rejected": 20}, 0),
    ],
    ids=["certain", "not yet", "restless", "far beyond unrest", "unrest unknown", "inconsistent", "wheels slip"],
)
def test_a_constant_is_noted_once_it_is_certain(sigmas, changed, found):
    assert noted(sigmas, **(CALM | changed)) == found


def test_small_differences_are_not_noted():
    x = np.full(STATES, 1e-4)
    counters = FilterCounters(**CALM)
    note_differences(x, 1e-14 * np.eye(STATES), counters.array[0])
    assert counters.differing == 0
