"""A warm start compiles nothing and says nothing."""

from services.robot_sim.warm_up import warm_up


def test_warm_up_is_silent_once_all_is_cached():
    warm_up()
    said = []
    warm_up(said.append)
    assert said == []
