"""Names that plug-ins use (docs/guides/plugins.md), imported when they are first used; all else may change."""

from touchline.lazy_names import lazy_names

_PUBLIC = {
    "Acting": "touchline.services.robot_sim.fault_effects.acting",
    "Area": "touchline.schemas.template",
    "Ask": "touchline.onboard.control",
    "BodyTwist": "touchline.onboard.control.follower",
    "ContinuousDubins": "touchline.services.planner.steering.ccd",
    "CoverageMethod": "touchline.services.planner.coverage.area_method",
    "CoverageRoute": "touchline.services.planner.coverage.coverage_route",
    "CoverageTask": "touchline.services.planner.coverage.coverage_task",
    "Curve": "touchline.schemas.curves",
    "DriveSpec": "touchline.schemas.vehicles",
    "Effects": "touchline.services.robot_sim.world.effects",
    "Fault": "touchline.schemas.faults",
    "Follower": "touchline.onboard.control.follower",
    "KindParts": "touchline.schemas.plugins",
    "Method": "touchline.services.planner.transitions.method_choice",
    "OnboardDrive": "touchline.onboard.drives.onboard_drive",
    "OnboardSensor": "touchline.onboard.estimation.auxiliary_models",
    "PathFollower": "touchline.onboard.control.follower",
    "PlannedDrive": "touchline.services.planner.drives.planned_drive",
    "Plugin": "touchline.schemas.plugins",
    "PoseMethod": "touchline.services.planner.poses.pose_method",
    "PurePursuitFollower": "touchline.onboard.control",
    "ScalarUpdate": "touchline.onboard.estimation.auxiliary_models",
    "SensorSpec": "touchline.schemas.vehicles",
    "SensorTruth": "touchline.schemas.sensor_truth",
    "SpeedLaw": "touchline.services.planner.poses.speed_laws",
    "TransitionFamily": "touchline.services.planner.transitions.transitions",
    "Vehicle": "touchline.schemas.vehicles",
    "WorldDrive": "touchline.services.robot_sim.world.drives.world_drive",
    "WorldSensor": "touchline.services.robot_sim.sensors.auxiliary_truth",
    "kernel": "touchline.core.jit",
    "parallel": "touchline.services.planner.coverage.parallel",
}
__all__ = sorted(_PUBLIC)  # noqa: PLE0605 - of the table
__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)
