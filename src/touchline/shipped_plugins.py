"""The shipped plug-ins of each kind, and the modules that make them, which are imported when they are first used."""

from touchline.schemas.plugins import (
    AREA_METHODS,
    DRIVES,
    EXTERNAL,
    EXTERNAL_TIMED,
    FAULTS,
    FOLLOWERS,
    METHODS,
    POSE_METHODS,
    SENSORS,
    SPEED_LAWS,
    TEAM_ALGORITHMS,
    TOOLS,
    KindParts,
)
from touchline.schemas.sensor_names import BUMPER_STRIP, CAMERA, ENCODER, GNSS, IMU, LIDAR, MAGNETOMETER, RANGER

_VEHICLES = "touchline.schemas.vehicles"
_DRIVES = "touchline.services.planner.drives"
_METHODS = "touchline.services.planner.transitions.methods"
_COVERAGE = "touchline.services.planner.coverage"
_POSES = "touchline.services.planner.poses.shipped_methods"
_LAWS = "touchline.services.planner.poses.speed_laws"
_WORLD = "touchline.services.robot_sim.world"
_FAULTS = "touchline.schemas.faults"
_FAULT_EFFECTS = "touchline.services.robot_sim.fault_effects"
_FOLLOWERS = "touchline.onboard.control"

DRIVES.register(
    "differential",
    "two driven wheels on one axle, and casters",
    KindParts(
        f"{_VEHICLES}:DifferentialDrive",
        planner=f"{_DRIVES}.differential_caps:PlannedDifferential",
        onboard="touchline.onboard.drives.differential_onboard:OnboardDifferential",
        world=f"{_WORLD}.drives.differential:DifferentialInWorld",
    ),
)
DRIVES.register(
    "rear-steered",
    "a driven drum, and a steered wheel behind it",
    KindParts(
        f"{_VEHICLES}:RearSteeredDrive",
        planner=f"{_DRIVES}.rear_steered_caps:PlannedRearSteered",
        onboard="touchline.onboard.drives.rear_steered_onboard:OnboardRearSteered",
        world=f"{_WORLD}.drives.rear_steered:RearSteeredInWorld",
    ),
)
TOOLS.register(
    "sprayer",
    "a nozzle that paints lines, with valve, discs and tank",
    KindParts(f"{_VEHICLES}:SprayerTool", world=f"{_WORLD}.tools.spraying:SprayerInWorld"),
)
TOOLS.register(
    "none",
    "nothing: the vehicle drives along lines and leaves nothing there",
    KindParts(f"{_VEHICLES}:NoTool", world=f"{_WORLD}.tools.idle_tool:NoToolInWorld"),
)
TOOLS.register(
    "roller",
    "a drum that rolls the ground, both ways and at any speed",
    KindParts(f"{_VEHICLES}:RollerTool", world=f"{_WORLD}.tools.rolling:RollerInWorld"),
)
# Their numbers are those that kernels know them by: what is new comes last.
SENSORS.register(GNSS, "positions of the GNSS receiver", None)
SENSORS.register(IMU, "rates and accelerations", None)
SENSORS.register(MAGNETOMETER, "the magnetic field", None)
SENSORS.register(ENCODER, "angles of the drive's actuators", None)
SENSORS.register(CAMERA, "poses by the camera overhead", None)
SENSORS.register(
    LIDAR,
    "ranges to things all round, in a plane above the ground",
    KindParts(
        "touchline.schemas.vehicles.lidar_spec:LidarSpec",
        truth="touchline.schemas.lidar_truth:LidarTruth",
        world="touchline.services.robot_sim.sensors.lidar_in_world:LidarInWorld",
    ),
)
SENSORS.register(
    RANGER,
    "distance of the nearest thing in a cone, by ultrasound",
    KindParts(
        "touchline.schemas.vehicles.ranger_spec:RangerSpec",
        truth="touchline.schemas.ranger_truth:RangerTruth",
        world="touchline.services.robot_sim.sensors.ranger_in_world:RangerInWorld",
    ),
)
SENSORS.register(
    BUMPER_STRIP,
    "a stretch of the outline that feels contacts",
    KindParts(
        "touchline.schemas.vehicles.bumper_strip_spec:BumperStripSpec",
        world="touchline.services.robot_sim.sensors.bumper_strip_in_world:BumperStripInWorld",
    ),
)
# Kind, line for people, class of its fields; the function that applies it has the kind's name.
for _kind, _summary, _fields, _module in (
    ("gnss-outage", "the GNSS receiver has no position", "GnssOutage", "gnss_faults"),
    ("gnss-degraded", "the GNSS solution is degraded", "GnssDegraded", "gnss_faults"),
    ("corrections-lost", "no RTK corrections arrive", "CorrectionsLost", "gnss_faults"),
    ("gnss-wrong-fix", "the GNSS has a wrong fix", "GnssWrongFix", "gnss_faults"),
    ("gnss-noisy", "the GNSS is disturbed", "GnssNoisy", "gnss_faults"),
    ("camera-outage", "the camera does not see the robot", "CameraOutage", "sensor_faults"),
    ("camera-swapped", "the camera takes another robot for this one", "CameraSwapped", "sensor_faults"),
    ("lidar-blind", "the lidars see nothing", "LidarBlind", "sensor_faults"),
    ("lidar-false-returns", "the lidars see what is not there", "LidarFalseReturns", "sensor_faults"),
    ("messages-late", "messages come late", "MessagesLate", "message_faults"),
    ("messages-duplicated", "messages come twice", "MessagesDuplicated", "message_faults"),
    ("messages-reordered", "messages come out of order", "MessagesReordered", "message_faults"),
    ("messages-lost", "messages are lost", "MessagesLost", "message_faults"),
    ("clock-skew", "the GNSS receiver's clock is off", "ClockSkew", "gnss_faults"),
    ("imu-bias", "the IMU's bias has jumped", "ImuBias", "sensor_faults"),
    ("imu-noisy", "the IMU vibrates", "ImuNoisy", "sensor_faults"),
    ("imu-stuck", "the IMU is frozen", "ImuStuck", "sensor_faults"),
    ("magnetic-disturbance", "the magnetic field is disturbed", "MagneticDisturbance", "sensor_faults"),
    ("encoder-dropout", "a wheel encoder counts nothing", "EncoderDropout", "actuator_faults"),
    ("wheel-blocked", "a wheel is blocked", "WheelBlocked", "actuator_faults"),
    ("wheel-slip", "a wheel slips", "WheelSlip", "actuator_faults"),
    ("motor-weak", "a motor is weak", "MotorWeak", "actuator_faults"),
    ("steering-offset", "the steering is off", "SteeringOffset", "actuator_faults"),
    ("valve-stuck", "the valve is stuck", "ValveStuck", "body_faults"),
    ("disc-stuck", "the discs are stuck", "DiscStuck", "body_faults"),
    ("nozzle-clogged", "the nozzle is clogged", "NozzleClogged", "body_faults"),
    ("bumper", "the bumper is pressed", "Bumper", "body_faults"),
    ("battery-low", "the battery is low", "BatteryLow", "body_faults"),
    ("tank-empty", "the tank is empty", "TankEmpty", "body_faults"),
    ("operator-lost", "the operator cannot be heard", "OperatorLost", "body_faults"),
):
    _apply = f"{_FAULT_EFFECTS}.{_module}:{_kind.replace('-', '_')}"
    FAULTS.register(_kind, _summary, KindParts(f"{_FAULTS}:{_fields}", world=_apply))
METHODS.register(
    "g2",
    "quickest: turns by the wheels' limits, reversing too",
    f"{_METHODS}:G2",
    empty={"kappa_max_1pm": "by the wheels", "sigma_max_1pm2": "by the wheels"},
)
METHODS.register("ccd", "smooth: one kind of curvature-continuous turn", f"{_METHODS}:CCD")
METHODS.register("dubins-padded", "baseline: plain arcs with padding", f"{_METHODS}:DUBINS_PADDED")
AREA_METHODS.register("parallel", "straight swaths side by side", f"{_COVERAGE}.parallel:parallel")
AREA_METHODS.register(
    "lap-and-lanes",
    "for rollers: laps along the edges, then lanes",
    f"{_COVERAGE}.coverage_methods:LAP_AND_LANES",
    covering=True,
)
AREA_METHODS.register(
    "zigzag",
    "for rollers, baseline: lanes there and back, an S between them",
    f"{_COVERAGE}.coverage_methods:ZIGZAG",
    covering=True,
)
FOLLOWERS.register("mpc", "model predictive control of the nozzle", f"{_FOLLOWERS}:make_mpc")
FOLLOWERS.register("pure-pursuit", "pursuit of a point ahead, with less computing", f"{_FOLLOWERS}:make_pure_pursuit")
FOLLOWERS.register(
    "pursuit-lanes",
    "baseline: a study's pursuit of a point 5 m ahead, lane by lane",
    f"{_FOLLOWERS}:make_pursuit_lanes",
)
FOLLOWERS.register("frenet", "a path law with a proof: steers by distance and angle", f"{_FOLLOWERS}:make_frenet")
FOLLOWERS.register(
    "regularised",
    "keeps the plan's time: a nonlinear law with the linear one's gains",
    f"{_FOLLOWERS}.timed:make_regularised",
)
FOLLOWERS.register(
    "nonlinear",
    "keeps the plan's time: a law that converges from anywhere",
    f"{_FOLLOWERS}.timed:make_nonlinear",
)
FOLLOWERS.register(
    "linear",
    "baseline, keeps the plan's time: a study's law, wild where the plan rests",
    f"{_FOLLOWERS}.timed:make_linear",
)
FOLLOWERS.register(
    "linear-scaled",
    "baseline, keeps the plan's time: linear, its gains scaled by the speed",
    f"{_FOLLOWERS}.timed:make_linear_scaled",
)
FOLLOWERS.register(
    "dynamic",
    "baseline, keeps the plan's time: linear in the position, blind to the heading",
    f"{_FOLLOWERS}.timed:make_dynamic",
)
FOLLOWERS.register(EXTERNAL, "your own program, asked over the bus", f"{_FOLLOWERS}:ExternalFollower")
FOLLOWERS.register(
    EXTERNAL_TIMED,
    "your own program, asked over the bus, with a reference that keeps the plan's time",
    f"{_FOLLOWERS}:make_external_timed",
)
POSE_METHODS.register("g2", "quickest: continuous in curvature, reversing and turning on the spot too", f"{_POSES}:G2")
POSE_METHODS.register("cubic", "one cubic curve, which bends evenly", f"{_POSES}:CUBIC")
POSE_METHODS.register("dubins", "shortest of arcs of one radius and lines", f"{_POSES}:DUBINS")
POSE_METHODS.register("dubins-free", "the same to a place, with whatever heading", f"{_POSES}:DUBINS_FREE")
POSE_METHODS.register("bearing", "baseline: the same, heading as the goal lies from the start", f"{_POSES}:BEARING")
POSE_METHODS.register("turn-line-turn", "turn on the spot, drive straight, turn", f"{_POSES}:TURN_LINE_TURN")
SPEED_LAWS.register("limits", "fastest: as limits of speed and acceleration allow", f"{_LAWS}:LIMITS")
SPEED_LAWS.register("quintic", "s = 10τ³ − 15τ⁴ + 6τ⁵: smooth at both ends", f"{_LAWS}:QUINTIC")
SPEED_LAWS.register("cubic", "s = 3τ² − 2τ³: at rest at both ends", f"{_LAWS}:CUBIC")
SPEED_LAWS.register("uniform", "baseline: s = τ, which begins and ends in a jump", f"{_LAWS}:UNIFORM")

TEAM_ALGORITHMS.register(
    "grid-ways",
    "all ways to goals together, on a grid",
    "touchline.coordination.mapf.mapf_algorithm:GridWays",
)

_ALL = (DRIVES, TOOLS, FAULTS, SENSORS, METHODS, AREA_METHODS, FOLLOWERS, POSE_METHODS, SPEED_LAWS, TEAM_ALGORITHMS)
for _registry in _ALL:
    _registry.close_shipped()
