"""Gymnasium environments in which a controller learns to follow a plan; see docs/guides/gym.md.

Importing this registers them, for `gymnasium.make("touchline/FollowPlan-v0")` and `gymnasium.make_vec`.
"""

from touchline.lazy_names import lazy_names
from touchline.schemas.optional_packages import require

require("gymnasium", "touchline.gym")

from gymnasium.envs.registration import register  # noqa: E402 - which is there

_PUBLIC = {
    "FollowPlan": "touchline.gym.follow_plan",
    "FollowPlanOptions": "touchline.gym.follow_task",
    "FollowPlanVector": "touchline.gym.follow_plan_vector",
}
__all__ = sorted(_PUBLIC)  # noqa: PLE0605 - of the table
__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)

register(
    "touchline/FollowPlan-v0",
    entry_point=f"{_PUBLIC['FollowPlan']}:FollowPlan",
    vector_entry_point=f"{_PUBLIC['FollowPlanVector']}:FollowPlanVector",
)
