"""Names that algorithms of teams use (docs/guides/team-algorithms.md), imported when they are first used."""

from touchline.lazy_names import lazy_names

_INTERFACE = dict.fromkeys(
    (
        "HOLD",
        "GoalWish",
        "Hold",
        "Me",
        "PathWish",
        "RobotAlgorithm",
        "Team",
        "TeamAlgorithm",
        "TwistWish",
        "VelocityWish",
        "Wish",
    ),
    "touchline.coordination.algorithms.team_algorithm",
)
_PUBLIC = {
    **_INTERFACE,
    "Neighbours": "touchline.coordination.algorithms.neighbours",
    "PointShares": "touchline.coordination.point_shares",
}
__all__ = sorted(_PUBLIC)  # noqa: PLE0605 - of the table
__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)
