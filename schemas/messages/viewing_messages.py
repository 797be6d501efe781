"""The standard ROS 2 messages that viewers draw: transforms, paths and markers, as in ROS 2 Jazzy."""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from touchline.schemas.messages.base import Int32, Message, UInt8Array, UInt32
from touchline.schemas.messages.standard import Header, Point, Pose, PoseStamped, Quaternion, Vector3


class TransformMessage(Message):
    """From a child frame to its parent: rotated, then moved (m)."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Transform"
    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


class TransformStamped(Message):
    """Pose of ``child_frame_id`` in ``header.frame_id``."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/TransformStamped"
    header: Header = Header()
    child_frame_id: str = ""
    transform: TransformMessage = TransformMessage()


class TFMessage(Message):
    """Several transforms."""

    ros_type: ClassVar[str] = "tf2_msgs/msg/TFMessage"
    transforms: tuple[TransformStamped, ...] = ()


class NavPath(Message):
    """Poses along a way; ``Path`` is the robot's own type."""

    ros_type: ClassVar[str] = "nav_msgs/msg/Path"
    header: Header = Header()
    poses: tuple[PoseStamped, ...] = ()


class Point32(Message):
    """Position, metres, of half the size."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Point32"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class PolygonMessage(Message):
    """Corners of an outline; the last one is joined to the first one."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/Polygon"
    points: tuple[Point32, ...] = ()


class PolygonStamped(Message):
    """An outline in a frame."""

    ros_type: ClassVar[str] = "geometry_msgs/msg/PolygonStamped"
    header: Header = Header()
    polygon: PolygonMessage = PolygonMessage()


class ColorRGBA(Message):
    """Red, green, blue and opacity, each 0…1."""

    ros_type: ClassVar[str] = "std_msgs/msg/ColorRGBA"
    r: float = 0.0
    g: float = 0.0
    b: float = 0.0
    a: float = 0.0


class Duration(Message):
    """Seconds and nanoseconds."""

    ros_type: ClassVar[str] = "builtin_interfaces/msg/Duration"
    sec: Int32 = 0
    nanosec: Annotated[UInt32, Field(lt=1_000_000_000)] = 0


def _no_bytes() -> UInt8Array:
    return np.zeros(0, dtype=np.uint8)


class CompressedImage(Message):
    """A picture; markers have one as texture."""

    ros_type: ClassVar[str] = "sensor_msgs/msg/CompressedImage"
    header: Header = Header()
    format: str = ""
    data: UInt8Array = Field(default_factory=_no_bytes)


class UVCoordinate(Message):
    """A place on a texture."""

    ros_type: ClassVar[str] = "visualization_msgs/msg/UVCoordinate"
    u: float = 0.0
    v: float = 0.0


class MeshFile(Message):
    """A file with a mesh."""

    ros_type: ClassVar[str] = "visualization_msgs/msg/MeshFile"
    filename: str = ""
    data: UInt8Array = Field(default_factory=_no_bytes)


class Marker(Message):
    """A shape in ``header.frame_id``, known by ``ns`` and ``id``: the next one of the same name takes its place.

    ``scale.x`` is the width of lines (m); ``lifetime`` 0 is for ever; a ``frame_locked`` one moves with its frame.
    """

    ros_type: ClassVar[str] = "visualization_msgs/msg/Marker"
    CUBE: ClassVar[int] = 1
    SPHERE: ClassVar[int] = 2
    LINE_STRIP: ClassVar[int] = 4
    LINE_LIST: ClassVar[int] = 5
    TRIANGLE_LIST: ClassVar[int] = 11
    ADD: ClassVar[int] = 0
    DELETE: ClassVar[int] = 2
    DELETEALL: ClassVar[int] = 3
    header: Header = Header()
    ns: str = ""
    id: Int32 = 0
    type: Int32 = 0
    action: Int32 = 0
    pose: Pose = Pose()
    scale: Vector3 = Vector3()
    color: ColorRGBA = ColorRGBA()
    lifetime: Duration = Duration()
    frame_locked: bool = False
    points: tuple[Point, ...] = ()
    colors: tuple[ColorRGBA, ...] = ()
    texture_resource: str = ""
    texture: CompressedImage = CompressedImage()
    uv_coordinates: tuple[UVCoordinate, ...] = ()
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = MeshFile()
    mesh_use_embedded_materials: bool = False


class MarkerArray(Message):
    """Several markers."""

    ros_type: ClassVar[str] = "visualization_msgs/msg/MarkerArray"
    markers: tuple[Marker, ...] = ()
