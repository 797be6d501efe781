"""Raster of the true paint along lines."""

import numpy as np

from benchmarks._true_paint import painted_cells
from touchline.schemas.curves import Curve
from touchline.schemas.messages import PaintMarks


def test_paint_beyond_the_beginning_of_a_line_is_none_of_it() -> None:
    line = Curve(0.0, 0.0, 0.0, 0.0, 5.0)
    stroke = PaintMarks(x_m=np.array([1.0, 0.0, -0.02, -0.03]), y_m=np.zeros(4))
    assert np.flatnonzero(painted_cells(line, [stroke])).max() == 100
