"""Frames by pandas and polars hold what the structured array holds."""

import numpy as np
import pytest

from touchline.api.data_frames import as_frame

TABLE = np.array(
    [(0.5, 1, True, "a", (1.0, 2.0)), (np.nan, 2, False, "é", (3.0, 4.0))],
    [("x_m", float), ("count", np.int64), ("on", bool), ("label", "U4"), ("pose", float, 2)],
)


@pytest.mark.parametrize("kind", ["pandas", "polars"])
def test_columns_keep_values_and_types(kind: str) -> None:
    TABLE.flags.writeable = False
    frame = as_frame(TABLE, kind)  # type: ignore[arg-type]
    assert type(frame).__module__.partition(".")[0] == kind
    assert list(frame.columns) == ["x_m", "count", "on", "label", "pose[0]", "pose[1]"]
    columns = {name: frame[name].to_numpy() for name in frame.columns}
    assert np.array_equal(columns["x_m"], TABLE["x_m"], equal_nan=True)
    assert columns["count"].dtype == np.int64 and columns["on"].dtype == bool
    assert columns["label"].tolist() == ["a", "é"] and columns["pose[1]"].tolist() == [2.0, 4.0]


def test_pandas_comes_first() -> None:
    assert type(as_frame(TABLE)).__module__.partition(".")[0] == "pandas"
