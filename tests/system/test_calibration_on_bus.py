"""Calibration drive of a robot on the bus."""

from itertools import pairwise

from tests.system.test_shared_run import Silent
from touchline.bus import Bus
from touchline.checking.check_session import check_recording
from touchline.jobs.calibration.calibration_on_bus import CalibrationRun
from touchline.jobs.single.bus_run import JobOptions
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import PlanOptions, RobotOrder
from touchline.schemas.setup import Setup
from touchline.services.planner.calibration_drive import REST_S, plan_calibration
from touchline.supervision.temporary_system import ProcessOptions, local_system


def test_a_robot_rests_between_its_stretches_and_its_session_comes_out_the_same(tmp_path):
    setup, path = Setup(), tmp_path / "calibration.mcap"
    drive = plan_calibration(setup.vehicle)
    options = ProcessOptions(without=(topics.PLANNER,), recordings=tmp_path)
    with local_system({"tt2": setup}, options=options, join_as=topics.OBSERVER) as system:
        system.wait_until_ready(lambda text: None)
        with Bus.open(topics.OPERATOR, system.bus.config.of("tt2")) as bus:
            job = JobOptions("", PlanOptions(), 20.0, path, vehicle=setup.vehicle)
            done = CalibrationRun(bus, job, Silent(), drive=drive).run()
    assert done["success"], done["reason"]
    orders = [
        decode(RobotOrder, message.payload)
        for message in RecordingReader(path).messages()
        if message.topic.endswith(topics.ORDERS.name)
    ]
    let_on = [order for order in orders if order.name == "authorize"]
    assert len(let_on) == len(drive.rests) + 1
    times_s = [order.header.stamp.seconds for order in let_on]
    assert all(after - before >= REST_S for before, after in pairwise(times_s))
    (one,) = check_recording(path)
    assert one.passed
    assert one.planned == 1
