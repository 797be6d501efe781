"""The sessions that are shipped come out the same, through the plugin that anybody's tests use."""

from pathlib import Path

import pytest

from tests.checking.short_sessions import BRIEF, bend, given, record
from tests.checking.test_mutations import MUTATIONS
from touchline.checking import pytest_plugin
from touchline.checking.check_files import check_file
from touchline.checking.check_session import update_recording
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import NotRebuilt, TimedOrder
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.services.robot_sim import emulator

pytest_plugins = ["pytester"]
SESSIONS = Path(__file__).resolve().parents[2] / "examples" / "sessions"
pytestmark = pytest.mark.xdist_group("checking")


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.touchline_session(f"examples/sessions/{path.name}"), id=path.stem)
        for path in sorted(SESSIONS.glob("*.mcap"))
    ],
)
def test_every_shipped_session_comes_out_the_same_and_is_small(touchline_session, path):
    assert path.stat().st_size <= 1_000_000
    touchline_session.require_same()


def test_a_difference_is_told_by_the_assertion(pytester, monkeypatch):
    monkeypatch.setattr(emulator, "World", emulator.World)  # put back afterwards
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # others end what they have begun for this process
    bend(pytester.path / "bend.mcap", BRIEF)
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.touchline_session("bend.mcap")
        def test_bend(touchline_session):
            touchline_session.require_same()

        @pytest.mark.touchline_session("nowhere.mcap")
        def test_nothing(touchline_session):
            pass
        """
    )
    pytester.makeconftest(
        """
        from touchline.services.robot_sim import emulator
        real = emulator.World

        def lighter(vehicle, scenario):
            body = vehicle.body.model_copy(update={"mass_empty_kg": 50.0})
            return real(vehicle.model_copy(update={"body": body}), scenario)

        emulator.World = lighter
        """
    )
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", pytest_plugin.__name__)
    result.assert_outcomes(failed=1, errors=1)
    result.stdout.fnmatch_lines(["*bend.mcap (tt2): differs first in the world: at * s *recorded *, today *"])
    result.stdout.fnmatch_lines(["*nowhere.mcap is neither in the test's folder nor in*"])


def test_a_session_is_written_anew_on_purpose(tmp_path, monkeypatch):
    path = bend(tmp_path / "bend.mcap", BRIEF)
    mutate, _ = MUTATIONS["a heavier body"]
    mutate(monkeypatch)
    (before,) = check_file("", path)
    assert not before.passed
    assert before.part == "world"
    update_recording(path)
    (after,) = check_file("", path)
    assert after.passed
    assert [each.name for each in tmp_path.iterdir()] == ["bend.mcap"]


def test_a_session_with_an_order_that_is_refused_today_stays_as_it_is(tmp_path):
    """The robot stays paused; nobody waits for the end of its job."""
    orders = (TimedOrder(0, "start", {}), TimedOrder(430, "pause", {}), TimedOrder(450, "start", {}))
    session = given(Setup(scenario=Scenario(seed=3)), orders)
    path = tmp_path / "bend.mcap"
    path.write_bytes(b"as it was")
    with pytest.raises(NotRebuilt, match=r"at 4\.50 s the robot refuses to start"):
        record(path, session)
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("bend.mcap", b"as it was")]
    rebuild = Rebuild(session)
    for _ in rebuild.whole():
        pass
    assert rebuild.refused and rebuild.tick == 450
