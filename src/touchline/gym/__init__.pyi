"""Public names of the environments; see `__init__.py`."""

from touchline.gym.follow_plan import FollowPlan as FollowPlan
from touchline.gym.follow_plan_vector import FollowPlanVector as FollowPlanVector
from touchline.gym.follow_task import FollowPlanOptions as FollowPlanOptions
