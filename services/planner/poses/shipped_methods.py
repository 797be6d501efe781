"""Shipped pose methods."""

from typing import Final

from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.dubins_paths import Bearing, DubinsPaths, ToPoint
from touchline.services.planner.poses.g2_path import G2Path
from touchline.services.planner.poses.pose_method import PoseMethod
from touchline.services.planner.poses.turn_line_turn import TurnLineTurn

G2: Final[PoseMethod] = G2Path()
CUBIC: Final[PoseMethod] = CubicPath()
DUBINS: Final[PoseMethod] = DubinsPaths()
DUBINS_FREE: Final[PoseMethod] = ToPoint()
BEARING: Final[PoseMethod] = Bearing()
TURN_LINE_TURN: Final[PoseMethod] = TurnLineTurn()
