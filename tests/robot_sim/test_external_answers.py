"""Questions to an external follower, its good and bad answers, and whole sessions; without a bus."""

import math

import numpy as np
import pytest

from examples.external_follower import steer
from tests.robot_sim.scripted import along_x
from touchline.bus import CallError
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control import FollowerQuestion, Interrupted, PurePursuitFollower, nobody
from touchline.onboard.control.external import AHEAD_TICKS, ExternalFollower
from touchline.onboard.control.guarded_follower import GuardedFollower
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.control.timed.regularised import RegularisedLaw
from touchline.onboard.control.timed.tracking_law import LAW_MEMORY, TrackingErrors, Wanted
from touchline.onboard.control.timed.tracking_law import steer as track
from touchline.onboard.drives.onboard_drive import command as drive_command
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.trajectory import path_projection as t
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import FollowerStepRequest, FollowerStepResponse, TraversalStatus
from touchline.schemas.onboard import OnboardConfig, TrackingGains
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.lockstep import NOW_FIELDS, Lockstep
from touchline.services.robot_sim.telemetry import Telemetry

PLAN = along_x(0, 2, 4, 5, sprayed=[0, 1, 0], speed_mps=0.8)
SHORT_PLAN = along_x(0, 0.6, 1.2, 1.7, sprayed=[0, 1, 0], speed_mps=0.8)
VEHICLE = Vehicle()
LIMIT_RADPS = VEHICLE.drive.max_wheel_speed_radps


def inputs(speed_mps=1.0):
    """On the path at this speed."""
    now, ahead = np.zeros(tracking.COMMAND + 2), np.zeros((AHEAD_TICKS, t.AHEAD_COLUMNS))
    now[[tracking.EFFECT, tracking.EFFECT + 1]] = VEHICLE.drive.wheel_radius_m
    now[[tracking.SPEED, tracking.REFERENCE_SPEED]] = ahead[:, t.A_SPEED] = speed_mps
    now[[tracking.COMMAND, tracking.COMMAND + 1]] = speed_mps / VEHICLE.drive.wheel_radius_m
    return now, ahead


class Outside:
    """An outside follower; `answers` are twists or exceptions, the last one for good."""

    def __init__(self, *answers):
        self.answers, self.questions = list(answers), []

    def __call__(self, question):
        self.questions.append(question)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer


def test_its_twist_is_driven_as_far_as_the_wheels_can():
    follower, drive = ExternalFollower(VEHICLE, Outside((0.9, 0.1), (1e3, -1e3), (-1e300, 20.0))), drive_of(VEHICLE)
    wheels = np.zeros(2)
    for _ in range(3):
        now, ahead = inputs()
        drive_command(drive.figures, *follower.step(now, ahead)[:2], now, wheels)
        assert np.isfinite(wheels).all() and np.abs(wheels).max() <= LIMIT_RADPS
    assert (follower.fallbacks, follower.problem) == (0, "")


@pytest.mark.parametrize("bad", [(math.nan, 1.0), (1.0, math.nan), (math.inf, 1.0), (1.0, -math.inf)])
def test_what_is_no_twist_is_not_driven(bad):
    outside = Outside(bad, (1.0, 2.0))
    follower = GuardedFollower(ExternalFollower(VEHICLE, outside), "external", drive_of(VEHICLE))
    assert follower.step(*inputs())[:2] == (1.0, 0.0), "the reference's"
    assert "not finite" in follower.problem


@pytest.mark.parametrize("failure", [ConnectionError("gone"), Interrupted()])
def test_after_a_failure_it_is_not_asked_before_the_robot_rests(failure):
    outside = Outside((1.0, 2.0), failure, (3.0, 4.0))
    follower = ExternalFollower(VEHICLE, outside)
    follower.step(*inputs())
    for _ in range(5):
        assert follower.step(*inputs())[:2] == pytest.approx((1.0, 0.0), abs=1e-6)
    assert len(outside.questions) == 2
    assert follower.fallbacks == 5
    assert follower.problem == str(failure), "only a lack of answers is a reason to pause"
    follower.reset()
    assert follower.step(*inputs())[:2] == (3.0, 4.0)
    assert (follower.fallbacks, follower.problem) == (5, "")


def test_it_hears_where_a_motion_begins():
    outside = Outside((1.0, 1.0), (1.0, 1.0), Interrupted(), (1.0, 1.0))
    follower = ExternalFollower(VEHICLE, outside)
    for _ in range(4):
        follower.step(*inputs())
    follower.reset()
    for _ in range(2):
        follower.step(*inputs())
    assert [question.first for question in outside.questions] == [True, False, False, True, False]


def test_the_pursuit_that_brakes_for_it_has_learned_nothing_from_before():
    """Whatever went wrong in an earlier motion, it takes a tick in the next one as a new one would."""
    follower = ExternalFollower(VEHICLE, Outside(ConnectionError("gone")))
    now, ahead = inputs()
    off = now.copy()
    off[[tracking.LATERAL, tracking.NOZZLE_LATERAL]] = 0.05
    for _ in range(300):
        follower.step(off, ahead)
    spoiled = follower.step(now, ahead)
    follower.reset()
    assert follower.step(now, ahead) == PurePursuitFollower(VEHICLE).step(now, ahead) != spoiled


def test_a_session_is_asked_about_the_next_second_and_anew_after_a_pause():
    questions, pursuit = [], PurePursuitFollower(VEHICLE)

    def ask(question):
        questions.append(FollowerQuestion(question.first, question.now.copy(), question.ahead.copy()))
        return pursuit.step(question.now, question.ahead)[:2]

    emulator = Emulator(VEHICLE, Scenario(noise="none"), OnboardConfig(follower="external"), ask=ask)
    emulator.load(PLAN)
    emulator.start()

    def run(ticks):
        for _ in range(ticks):
            emulator.tick()

    run(350)
    assert emulator.onboard.state == TraversalStatus.RUNNING
    emulator.pause()
    run(300)
    asked = len(questions)
    run(50)
    assert len(questions) == asked, "it is not asked while the robot stands"
    emulator.resume()
    while emulator.active:
        emulator.tick()
    assert emulator.onboard.state == TraversalStatus.DONE
    begins = [index for index, question in enumerate(questions) if question.first]
    assert begins[0] == 0
    assert begins[1] == asked
    moving = questions[200]
    assert moving.ahead.shape == (100, 2)
    # A straight line at 0.8 m/s: a tick is 10 ms, so this is where it wants to be in a second.
    assert moving.ahead[:, t.A_SPEED] == pytest.approx(0.8)
    assert moving.ahead[:, t.A_YAW_RATE] == pytest.approx(0.0, abs=1e-9)
    braking = questions[begins[1] - 1].ahead[:, t.A_SPEED]
    assert abs(braking).max() < 0.05


class Answering:
    """A bus on which the follower answers a request with what `answer` makes of it."""

    def __init__(self, answer):
        self.answer, self.requests, self.timeouts_s = answer, [], []

    def call(self, _service, request, timeout_s, while_waiting):
        while_waiting()
        self.timeouts_s.append(timeout_s)
        self.requests.append(request)
        return self.answer(request)


def question():
    now, ahead = np.arange(1.0, tracking.COMMAND + 3), np.arange(2.0 * AHEAD_TICKS).reshape(-1, 2)
    return FollowerQuestion(True, now, ahead)


def test_a_question_is_told_field_by_field_and_the_answer_is_speed_then_yaw_rate():
    bus = Answering(lambda request: FollowerStepResponse(step=request.step, speed_mps=0.3, yaw_rate_radps=0.4))
    ask = Lockstep(bus)
    assert ask(question()) == (0.3, 0.4)
    ask(question()._replace(first=False))
    told, again = bus.requests
    assert [getattr(told, name) for name in NOW_FIELDS] == list(range(1, len(NOW_FIELDS) + 1))
    assert (told.lateral_m, told.yaw_rate_radps) == (1.0 + tracking.LATERAL, 1.0 + tracking.YAW_RATE)
    assert (told.speed_mps, told.reference_speed_mps) == (1.0 + tracking.SPEED, 1.0 + tracking.REFERENCE_SPEED)
    assert list(told.ahead_speed_mps) == list(range(0, 200, 2))
    assert list(told.ahead_yaw_rate_radps) == list(range(1, 200, 2))
    assert (told.first, again.first) == (True, False)
    assert again.step == told.step + 1
    assert bus.timeouts_s == [1.0, 1.0], "as long as the documentation says"


def refuse(error):
    def answer(_request):
        raise error

    return answer


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (lambda request: FollowerStepResponse(step=request.step - 1), "answered step"),
        (lambda request: FollowerStepResponse(step=request.step + 1), "answered step"),
        (refuse(CallError("no answer within 1.0 s")), "no answer within 1.0 s"),
        (refuse(PayloadError("truncated")), "truncated"),
    ],
    ids=["late", "early", "silent", "garbage"],
)
def test_no_answer_or_another_ones_is_no_answer(answer, says):
    ask = Lockstep(Answering(answer))
    with pytest.raises(ConnectionError, match=says):
        ask(question())
    with pytest.raises(ConnectionError, match=says):
        ask(question())


def test_whoever_wants_to_stop_the_robot_breaks_the_wait_off():
    answered = Answering(lambda request: FollowerStepResponse(step=request.step))
    with pytest.raises(Interrupted):
        Lockstep(answered, lambda: True)(question())
    assert answered.requests == []


def answered_by(controller):
    """Function that asks a controller which hears and answers in messages."""

    def answer(request):
        speed_mps, yaw_rate_radps = controller(decode(FollowerStepRequest, encode(request)))
        return FollowerStepResponse(step=request.step, speed_mps=speed_mps, yaw_rate_radps=yaw_rate_radps)

    return Lockstep(Answering(answer))


def session(follower, ask=nobody, ticks=1500):
    emulator = Emulator(VEHICLE, Scenario(), OnboardConfig(follower=follower), ask=ask)
    telemetry = Telemetry(emulator)
    emulator.load(SHORT_PLAN)
    emulator.start()
    payloads = []
    while emulator.active and emulator.tick_count < ticks:
        emulator.tick()
        payloads += telemetry.after_tick()
    return emulator, payloads


def test_one_that_keeps_the_plans_time_is_told_all_that_it_needs():
    gains = TrackingGains()
    law = RegularisedLaw(gains.frequency_radps, gains.damping, gains.slow_mps)
    lead = lead_ticks(drive_of(VEHICLE).lag_s)
    side_slip = drive_of(VEHICLE).side_slip_rad_per_mps2

    def controller(request):
        crab = side_slip * request.speed_mps * request.ahead_yaw_rate_radps[0]
        errors = TrackingErrors(request.along_m, request.across_m, request.turn_rad + crab)
        wanted = Wanted(
            float(request.ahead_speed_mps[lead]),
            float(request.ahead_yaw_rate_radps[lead]),
            request.reference_acceleration_mps2,
        )
        return track(law, errors, wanted, np.zeros(LAW_MEMORY))

    emulator, there = session("external-timed", answered_by(controller))
    _, here = session("regularised")
    assert emulator.onboard.state == TraversalStatus.DONE
    assert there == here


def test_the_example_drives_a_line():
    emulator, _ = session("external", answered_by(steer))
    assert emulator.onboard.state == TraversalStatus.DONE
    assert np.abs(emulator.work.ledger.deviation().lateral_m).max() < 0.04


def test_without_one_the_robot_pauses_and_says_so():
    emulator, _ = session("external", ticks=250)
    assert emulator.onboard.state == TraversalStatus.PAUSED
    assert emulator.onboard.status.reason == "no external follower is connected"
    assert emulator.world.pose.east_m < 0.05
    assert not emulator.command.valve
