"""The standard ROS 2 messages that Touchline uses; field meanings are those of their packages."""

from typing import Annotated, ClassVar, Self

from pydantic import Field

from touchline.schemas.messages.base import (
    Float32Array,
    Float64Array,
    Int8,
    Int32,
    Message,
    UInt8,
    UInt16,
    UInt32,
    zeros,
)


class Time(Message):
    """Seconds and nanoseconds of sim time."""

    ros_type: ClassVar[str] = "builtin_interfaces/msg/Time"
    sec: Int32 = 0
    nanosec: Annotated[UInt32, Field(lt=1_000_000_000)] = 0

    @classmethod
    def of_ns(cls, nanoseconds: int) -> Self:
        """From nanoseconds."""
        return cls(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)

    @property
    def seconds(self) -> float:
        """Seconds, the nanoseconds as their fraction."""
        return self.sec + 1e-9 * self.nanosec


class Header(Message):
    """Stamp and coordinate frame."""

    ros_type: ClassVar[str] = "std_msgs/msg/Header"
    stamp: Time = Time()
    frame_id: str = ""


class String(Message):
    """Text."""

    ros_type: ClassVar[str] = "std_msgs/msg/String"
    data: str = ""


class Clock(Message):
    """Sim time."""

    ros_type: ClassVar[str] = "rosgraph_msgs/msg/Clock"
    clock: Time = Time()


class Point(Message):
    """Position, metres."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Point"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Vector3(Message):
    """Free vector."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Vector3"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Quaternion(Message):
    """Orientation."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Quaternion"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Pose(Message):
    """Position and orientation."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Pose"
    position: Point = Point()
    orientation: Quaternion = Quaternion()


class PoseStamped(Message):
    """A pose in a frame."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/PoseStamped"
    header: Header = Header()
    pose: Pose = Pose()


class Twist(Message):
    """Linear (m/s) and angular (rad/s) velocity."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Twist"
    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


Covariance36 = Annotated[Float64Array, Field(min_length=36, max_length=36)]
Covariance9 = Annotated[Float64Array, Field(min_length=9, max_length=9)]


class PoseWithCovariance(Message):
    """Pose with its row-major 6×6 covariance (x, y, z, roll, pitch, yaw)."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/PoseWithCovariance"
    pose: Pose = Pose()
    covariance: Covariance36 = zeros(36)


class PoseWithCovarianceStamped(Message):
    """Pose in ``header.frame_id``, with its covariance."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/PoseWithCovarianceStamped"
    header: Header = Header()
    pose: PoseWithCovariance = PoseWithCovariance()


class TwistWithCovariance(Message):
    """Twist with its row-major 6×6 covariance."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/TwistWithCovariance"
    twist: Twist = Twist()
    covariance: Covariance36 = zeros(36)


class Odometry(Message):
    """Pose in ``header.frame_id``, twist in ``child_frame_id``."""

    ros_type: ClassVar[str] = "nav_msgs/msg/Odometry"
    header: Header = Header()
    child_frame_id: str = ""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()


class NavSatStatus(Message):
    """Fix status: no fix −1, fix 0, satellite-based 1, ground-based augmentation 2 (RTK)."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/NavSatStatus"
    STATUS_NO_FIX: ClassVar[int] = -1
    STATUS_FIX: ClassVar[int] = 0
    STATUS_SBAS_FIX: ClassVar[int] = 1
    STATUS_GBAS_FIX: ClassVar[int] = 2
    SERVICE_GPS: ClassVar[int] = 1
    status: Int8 = -2
    service: UInt16 = 0


class NavSatFix(Message):
    """WGS 84 position of the antenna: degrees, metres above the ellipsoid, ENU covariance m²."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/NavSatFix"
    COVARIANCE_TYPE_UNKNOWN: ClassVar[int] = 0
    COVARIANCE_TYPE_APPROXIMATED: ClassVar[int] = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: ClassVar[int] = 2
    COVARIANCE_TYPE_KNOWN: ClassVar[int] = 3
    header: Header = Header()
    status: NavSatStatus = NavSatStatus()
    latitude: float = 0.0
    longitude: float = 0.0
    altitude: float = 0.0
    position_covariance: Covariance9 = zeros(9)
    position_covariance_type: UInt8 = 0


class Imu(Message):
    """Body-frame rates (rad/s) and specific force (m/s²); ``orientation_covariance[0] = -1``: no orientation."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/Imu"
    header: Header = Header()
    orientation: Quaternion = Quaternion()
    orientation_covariance: Covariance9 = zeros(9)
    angular_velocity: Vector3 = Vector3()
    angular_velocity_covariance: Covariance9 = zeros(9)
    linear_acceleration: Vector3 = Vector3()
    linear_acceleration_covariance: Covariance9 = zeros(9)


class MagneticField(Message):
    """Body-frame magnetic field, tesla."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/MagneticField"
    header: Header = Header()
    magnetic_field: Vector3 = Vector3()
    magnetic_field_covariance: Covariance9 = zeros(9)


class LaserScan(Message):
    """Ranges of a lidar (m), counter-clockwise; infinite without a return. The stamp is the time of the first beam."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/LaserScan"
    header: Header = Header()
    angle_min: float = 0.0
    angle_max: float = 0.0
    angle_increment: float = 0.0
    time_increment: float = 0.0
    scan_time: float = 0.0
    range_min: float = 0.0
    range_max: float = 0.0
    ranges: Float32Array = Field(default_factory=lambda: zeros(0).astype("float32"))
    intensities: Float32Array = Field(default_factory=lambda: zeros(0).astype("float32"))


class Range(Message):
    """Distance of the nearest thing in a cone (m); infinite without an echo."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/Range"
    ULTRASOUND: ClassVar[int] = 0
    header: Header = Header()
    radiation_type: UInt8 = 0
    field_of_view: float = 0.0
    min_range: float = 0.0
    max_range: float = 0.0
    range: float = 0.0
    variance: float = 0.0


class JointState(Message):
    """Wheel angles (rad) and rates (rad/s)."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/JointState"
    header: Header = Header()
    name: tuple[str, ...] = ()
    position: Float64Array = zeros(0)
    velocity: Float64Array = zeros(0)
    effort: Float64Array = zeros(0)


class BatteryState(Message):
    """Battery: volt, °C, ampere (negative when discharging), Ah; ``percentage`` is 0…1."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/BatteryState"
    POWER_SUPPLY_STATUS_CHARGING: ClassVar[int] = 1
    POWER_SUPPLY_STATUS_DISCHARGING: ClassVar[int] = 2
    POWER_SUPPLY_HEALTH_GOOD: ClassVar[int] = 1
    POWER_SUPPLY_TECHNOLOGY_LION: ClassVar[int] = 2
    header: Header = Header()
    voltage: float = 0.0
    temperature: float = 0.0
    current: float = 0.0
    charge: float = 0.0
    capacity: float = 0.0
    design_capacity: float = 0.0
    percentage: float = 0.0
    power_supply_status: UInt8 = 0
    power_supply_health: UInt8 = 0
    power_supply_technology: UInt8 = 0
    present: bool = False
    cell_voltage: Float32Array = Field(default_factory=lambda: zeros(0).astype("float32"))
    cell_temperature: Float32Array = Field(default_factory=lambda: zeros(0).astype("float32"))
    location: str = ""
    serial_number: str = ""


class KeyValue(Message):
    """One named diagnostic value."""

    ros_type: ClassVar[str] = "diagnostic_msgs/msg/KeyValue"
    key: str = ""
    value: str = ""


class DiagnosticStatus(Message):
    """Health of one component."""

    ros_type: ClassVar[str] = "diagnostic_msgs/msg/DiagnosticStatus"
    OK: ClassVar[int] = 0
    WARN: ClassVar[int] = 1
    ERROR: ClassVar[int] = 2
    STALE: ClassVar[int] = 3
    level: Annotated[UInt8, Field(le=3)] = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Message):
    """Health of several components."""

    ros_type: ClassVar[str] = "diagnostic_msgs/msg/DiagnosticArray"
    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()
