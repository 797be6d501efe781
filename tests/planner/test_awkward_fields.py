"""A sample of the benchmark's awkward fields: each is planned or refused with a reason, whatever its shape."""

import pytest

from benchmarks.fields import planned_fields


@pytest.mark.full
def test_small_awkward_fields_end_in_a_plan_or_a_reason() -> None:
    rows = planned_fields(range(3), 7, (0.002, 0.004))
    assert {row.vehicle for row in rows} == {"clay-roller", "half-roller", "mower"}
    assert all(row.ending == "planned" or row.ending.startswith("refused: has ") for row in rows)
    assert all(row.outside_m < 0.0 for row in rows if row.ending == "planned")
