import math

import pytest
from line_keeper import LineKeeper, compared

import touchline


def test_it_keeps_the_line() -> None:
    own_m, shipped_m = compared("study-square", LineKeeper())
    assert own_m < 0.005
    assert set(shipped_m) == {"mpc", "pure-pursuit"}


def test_a_follower_that_answers_nothing_ends_the_run() -> None:
    run = touchline.simulate("study-square", follower=LineKeeper(length_m=math.inf * 0.0))
    assert not run.success and "LineKeeper" in run.reason


def test_an_unknown_template_names_those_that_there_are() -> None:
    with pytest.raises(touchline.SpecError, match="study-square"):
        compared("study-sqare", LineKeeper())
