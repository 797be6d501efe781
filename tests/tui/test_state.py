"""The state model: what each message changes, and what a restart, a gap or nonsense does."""

import math

import numpy as np
import pytest

from tests.tui import scenes
from tests.tui.console import reduced
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.tui import panels, theme
from touchline.tui.event_log import ERROR, WARN, OperatorLog
from touchline.tui.protocol import Incoming, Lost, NodeChanged, PaintFetched, Rejected
from touchline.tui.reduction import apply_event
from touchline.tui.state import ConsoleState


def texts(state: ConsoleState) -> list[str]:
    return [entry.text for entry in state.log.entries]


def shown(state: ConsoleState, width: int = 40) -> str:
    return "\n".join(line.plain for line in panels.status_lines(state, width))


def test_at_first_nobody_is_there() -> None:
    state = ConsoleState()
    assert not state.robot_alive
    assert state.traversal is None
    assert "NO ROBOT" in shown(state)
    assert [line.plain for line in panels.service_lines(state, 40)][:3] == [
        "○ planner    not seen",
        "○ robot      not seen",
        "○ bridge     not seen",
    ]


def test_mid_run_shows_where_the_job_stands(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    assert state.traversal == m.TraversalStatus.RUNNING
    assert state.busy
    assert state.robot.sim_time_s == 754.0
    assert state.robot.fractions["corner-arc-north-west"] == 1.0
    assert state.robot.fractions[template.segments[14].id] == pytest.approx(0.55)
    assert state.goal == template.segments[14].id
    assert state.real_time_factor == 19.8
    assert state.speed_factor == 20.0
    text = shown(state)
    for part in ("RUNNING", "15/27", "53.9 %", "12:34", "7:11 left", "1.00 m/s", "+4 mm", "fixed", "83 %", "13.4 L"):
        assert part in text
    assert "open" in text


def test_the_level_is_a_share_of_the_tank_there_is(template: Template) -> None:
    def is_low(state: ConsoleState) -> bool:
        (line,) = [line for line in panels.status_lines(state, 40) if "13.4 L" in line.plain]
        return any(span.style == theme.VERMILION for span in line.spans)

    assert not is_low(reduced(scenes.mid_run(template)))
    setup = m.String(data=Setup(vehicle=Vehicle(tool={"tank_l": 100.0})).model_dump_json())
    assert is_low(reduced([*scenes.mid_run(template), received(topics.SETUP, setup)]))


def test_heading_is_taken_from_the_quaternion() -> None:
    for heading in (-3.0, -0.5, 0.0, 1.2, 3.1):
        state = reduced([*scenes.up(), received(topics.ODOMETRY, scenes.odometry(3.0, -4.0, heading))])
        pose = state.robot.pose
        assert pose is not None
        assert (pose.x_m, pose.y_m) == (3.0, -4.0)
        assert pose.heading_rad == pytest.approx(heading)


def test_rows_follow_the_order_of_the_plan_which_another_template_drops(template: Template) -> None:
    state = ConsoleState()
    state.choose_template(template, template.model_dump_json())
    assert [row.segment_id for row in state.rows] == [segment.id for segment in template.segments]
    backwards = template.model_copy(update={"segments": template.segments[::-1]})
    state.planned(scenes.trajectory(backwards), m.PlanReport())
    assert [row.segment_id for row in state.rows] == [segment.id for segment in backwards.segments]
    assert state.rows[0].length_m == pytest.approx(backwards.segments[0].curve().length_m)
    assert not state.path_loaded
    state.choose_template(template, "{}")
    assert state.path is None


def test_a_transition_is_named_for_where_it_leads(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    apply_event(
        state,
        received(topics.STATUS, scenes.status(template, m.TraversalStatus.RUNNING, 14, segment_index=27)),
        now_s=1.0,
    )
    assert f"to {template.segments[14].label} 15/27" in shown(state, width=60)
    assert state.goal == template.segments[14].id


def test_what_is_prepared_stays_in_view_until_the_robot_is_busy(template: Template) -> None:
    """The robot's own job, told to a console that joins, must not replace what the operator has chosen there."""
    square = load_template("study-square")
    state = ConsoleState()
    state.choose_template(square, square.model_dump_json())
    reduced(scenes.loaded(template), state)
    assert state.template is not None
    assert state.template.template == square
    assert panels.hint(state) == ("p", "plan the path")
    state.planned(scenes.trajectory(square), m.PlanReport())
    assert panels.hint(state) == ("l", "load the plan")
    apply_event(state, received(topics.STATUS, scenes.status(template, m.TraversalStatus.RUNNING)), 1.0)
    assert state.template.template == template
    assert len(state.rows) == len(template.segments)
    apply_event(state, received(topics.STATUS, scenes.status(template, m.TraversalStatus.DONE)), 1.0)
    assert state.template.template == square
    state.handed_over()
    apply_event(state, received(topics.STATUS, scenes.status(square, m.TraversalStatus.READY)), 1.0)
    assert state.path_loaded


def test_what_the_robot_repeats_of_a_handed_over_job_keeps_its_figures(template: Template) -> None:
    state = reduced(scenes.up())
    state.choose_template(template, "as written")
    state.planned(scenes.trajectory(template), m.PlanReport(total_time_s=99.0))
    state.handed_over()
    reduced(scenes.loaded(template), state)
    assert state.path is not None
    assert state.path.report == m.PlanReport(total_time_s=99.0)
    assert state.template is not None
    assert state.template.text == "as written"


def test_plan_and_template_may_come_in_any_order(template: Template) -> None:
    events: list[Incoming] = [
        *scenes.up(),
        received(topics.PLAN, scenes.trajectory(template)),
        received(topics.TEMPLATE, m.String(data=template.model_dump_json())),
    ]
    for order in (events, [*events[:3], *events[:2:-1]]):
        state = reduced(order)
        assert state.path is not None
        assert len(state.path.rows) == len(template.segments)
        assert all(math.isfinite(row.length_m) for row in state.path.rows)
        assert state.loaded.path is state.path


def test_the_robot_going_away_leaves_nothing_stale(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    assert len(state.paint) > 0
    apply_event(state, NodeChanged(topics.ROBOT_SIM, False), 2.0)
    assert state.traversal is None
    assert state.robot.pose is None
    assert len(state.paint) == 0
    assert not state.path_loaded
    assert state.path is not None  # it can be loaded again
    assert state.log.entries[-1].severity == ERROR
    assert "NO ROBOT" in shown(state)
    assert "RUNNING" not in shown(state)


@pytest.mark.parametrize("missed", [False, True])
def test_a_restarted_robot_is_said_to_be_one_though_its_absence_may_be_missed(template: Template, missed: bool) -> None:
    state = reduced(scenes.mid_run(template))
    seen = [] if missed else [NodeChanged(topics.ROBOT_SIM, False), NodeChanged(topics.ROBOT_SIM, True)]
    reduced([*seen, received(topics.STATUS, m.TraversalStatus(), publisher="robot-2")], state)
    assert state.traversal == m.TraversalStatus.IDLE
    assert state.robot.pose is None
    assert state.paint.needs_fetch and len(state.paint) == 0
    assert any("robot restarted" in text for text in texts(state))
    assert not state.path_loaded
    assert panels.hint(state) == ("l", "load the plan")


def test_the_same_robot_seen_again_is_no_restart(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    reduced([NodeChanged(topics.ROBOT_SIM, False), NodeChanged(topics.ROBOT_SIM, True)], state)
    reduced(scenes.mid_run(template)[3:], state)
    assert state.traversal == m.TraversalStatus.RUNNING
    assert not any("robot restarted" in text for text in texts(state))


def test_a_new_run_clears_the_old_figures(template: Template) -> None:
    state = reduced(scenes.finished(template))
    assert "✓ complete" in shown(state)
    assert state.robot.driven_fraction == 1.0
    apply_event(state, received(topics.STATUS, scenes.status(template, m.TraversalStatus.RUNNING)), 2.0)
    assert state.robot.report is None


def test_a_new_plan_asks_for_the_paint_again(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    assert not state.paint.needs_fetch
    apply_event(state, received(topics.PLAN, scenes.trajectory(template)), 2.0)
    assert state.paint.needs_fetch
    apply_event(state, PaintFetched(None), 2.0)
    assert state.paint.needs_fetch
    apply_event(state, PaintFetched(()), 2.0)
    assert not state.paint.needs_fetch
    assert len(state.paint) == 0


def test_progress_of_other_consoles_is_not_shown() -> None:
    state = ConsoleState(plan_request="mine")
    apply_event(state, received(topics.PLANNER_PROGRESS, m.Progress(request_id="theirs", stage="x", fraction=0.5)), 1.0)
    assert state.progress is None
    apply_event(
        state, received(topics.PLANNER_PROGRESS, m.Progress(request_id="mine", stage="fitting", fraction=0.5)), 1.0
    )
    assert panels.hint(state) == ("", "planning: fitting 50 %")
    apply_event(state, NodeChanged(topics.PLANNER, True), 1.0)
    apply_event(state, NodeChanged(topics.PLANNER, False), 1.0)
    assert state.progress is None


def test_unreadable_messages_are_counted_and_logged_once() -> None:
    state = ConsoleState()
    for _ in range(5):
        apply_event(state, Rejected("imu/mag", "too short"), 1.0)
    apply_event(state, Rejected("plan", "too long"), 1.0)
    assert state.rejected == 6
    assert len(texts(state)) == 2
    apply_event(state, Lost(3), 1.0)
    assert panels.service_lines(state, 40)[-1].plain == "bus: 3 lost, 6 unreadable"


def test_messages_that_are_legal_but_make_no_sense_do_no_harm(template: Template) -> None:
    nan, inf = math.nan, math.inf
    nowhere = m.Segment(id="x", curve=m.CurveMessage())
    weird: list[Incoming] = [
        received(topics.ODOMETRY, scenes.odometry(nan, inf, 0.0)),
        received(topics.PLAN, m.Trajectory(path=m.Path(segments=(nowhere,)))),
        received(topics.TEMPLATE, m.String(data="{not json")),
        received(topics.TEMPLATE, m.String(data="[" * 10_000)),
        received(
            topics.STATUS,
            m.TraversalStatus(
                state=m.TraversalStatus.RUNNING,
                segment_index=10**6,
                total_length_m=nan,
                arc_length_m=inf,
                coverage_pct=nan,
                painted_ids=("a", "b"),
                painted_fraction=[nan],
                speed_mps=-inf,
                elapsed_s=nan,
                remaining_s=inf,
                lateral_error_m=nan,
            ),
        ),
        received(topics.BATTERY, m.BatteryState(percentage=nan)),
        received(topics.SPRAYER, m.SprayerState(tank_l=-inf)),
        received(topics.GNSS_STATUS, m.GnssStatus(horizontal_accuracy_m=nan)),
        received(topics.PAINT, m.PaintMarks(first_index=0, x_m=[nan, inf], y_m=[0.0])),
        received(topics.REPORT, m.TraversalReport(coverage_pct=nan, lateral_error_p95_m=nan)),
        received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM, real_time_factor="fast")),
        received(topics.DIAGNOSTICS, m.DiagnosticArray(status=(m.DiagnosticStatus(),))),
        received(topics.EVENTS, m.Event(text="\x1b[31mred[/bold]")),
        received(topics.CLOCK, m.Odometry()),
    ]
    state = reduced([*scenes.loaded(template), *weird])
    assert state.rejected >= 4
    assert state.robot.pose is None
    assert "–" in shown(state)
    assert state.path is not None  # the sensible plan from before


def test_diagnostics_are_per_process_the_worst_component_shows_and_death_ends_them() -> None:
    state = reduced([*scenes.up(), received(topics.DIAGNOSTICS, scenes.diagnostics(topics.ROBOT_SIM, speed_factor=20))])
    report = m.DiagnosticArray(
        status=(
            m.DiagnosticStatus(name="bridge: disk", level=m.DiagnosticStatus.WARN, message="nearly full"),
            m.DiagnosticStatus(name="bridge: recorder", message="fine"),
        )
    )
    apply_event(state, received(topics.DIAGNOSTICS, report), 5.0)
    assert panels.service_lines(state, 40)[2].plain.startswith("● bridge     nearly full")
    apply_event(state, received(topics.DIAGNOSTICS, scenes.diagnostics(topics.BRIDGE)), 6.0)
    assert panels.service_lines(state, 40)[2].plain.startswith("● bridge     ok")
    assert state.speed_factor == 20
    reduced([NodeChanged(topics.ROBOT_SIM, False)], state)
    assert panels.service_lines(state, 40)[1].plain.startswith("○ robot      down")
    reduced([NodeChanged(topics.ROBOT_SIM, True)], state)
    assert state.speed_factor is None


def test_the_log_counts_repeats_and_keeps_sim_time(template: Template) -> None:
    state = reduced(scenes.mid_run(template))
    warning = next(entry for entry in state.log.entries if entry.severity == WARN)
    assert warning.time_s == pytest.approx(412.3)
    log = OperatorLog()
    for _ in range(3):
        log.add(1.0, WARN, "robot", "bump")
    assert (len(log.entries), log.total, log.revision, log.entries[0].times) == (1, 1, 3, 3)
    for number in range(5000):
        log.add(1.0, WARN, "robot", str(number))
    assert len(log.entries) == 1000


def test_the_next_key_fits_the_state(template: Template) -> None:
    keys = {"READY": "s", "RUNNING": "space", "PAUSED": "g", "DONE": "t", "ABORTED": "r", "ESTOPPED": "r"}
    for name, key in keys.items():
        told = scenes.status(template, getattr(m.TraversalStatus, name))
        assert panels.hint(reduced([*scenes.loaded(template), received(topics.STATUS, told)]))[0] == key


def test_paint_is_thin_but_true(template: Template) -> None:
    state = reduced(scenes.finished(template))
    line = state.paint.line
    box = line.bounds()
    assert box == pytest.approx((-52.5, -34.0, 52.5, 34.0), abs=0.1)
    gaps = np.hypot(np.diff(line.x_m), np.diff(line.y_m))[line.joined[1:]]
    assert gaps.max() < 0.6
