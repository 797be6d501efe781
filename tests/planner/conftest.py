"""Settings of the planner's property tests."""

from hypothesis import settings

# The machine is shared: how long one example takes says nothing.
settings.register_profile("planner", deadline=None)
settings.load_profile("planner")
