import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from touchline.core.near_points import near_pairs

POINTS = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), max_size=12)


@given(POINTS, POINTS)
def test_pairs_are_those_of_a_full_search(first, second):
    a, b = (np.array(points, dtype=np.float64).reshape(-1, 2) for points in (first, second))
    apart = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
    assert near_pairs(a, b, 2.0).tolist() == np.argwhere(apart <= 2.0).tolist()
