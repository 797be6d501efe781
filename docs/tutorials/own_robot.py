# %% [markdown]
# # Your own robot and your own follower
#
# A vehicle is a data sheet; a follower can be a function.

# %%
import touchline

robot = touchline.load_vehicle("turf-tank-two")
wider = robot.replace("name", "wide").replace("drive.track_width_m", 0.6).replace("body.mass_empty_kg", 45.0)
print(wider.drive.track_width_m, "m between the wheels,", wider.body.mass_empty_kg, "kg")

# %% [markdown]
# What cannot be is refused, with the field and what is allowed.

# %%
try:
    robot.replace("drive.track_width_m", -1)
except touchline.SpecError as error:
    print(error.field, "|", error.remedy)

# %%
plan = touchline.plan("study-square", vehicle=wider)
print(plan, touchline.plan("study-square"))

# %% [markdown]
# A follower gets the tracking errors as the robot believes them, and the reference of the next second in steps of
# 10 ms. This one steers by the lateral error, looking 50 ms ahead for the delay of the wheels.


# %%
def by_distance(state: touchline.FollowerState, ahead: touchline.FollowerAhead) -> tuple[float, float]:
    """Follow the reference, and turn towards it in proportion to the errors."""
    speed = float(ahead.speed_mps[5])
    back = 5.7 * abs(speed) * (state.lateral_m / 0.35 + state.heading_error_rad)
    return speed, float(ahead.yaw_rate_radps[5]) - back


for follower in ("mpc", "pure-pursuit", by_distance):
    run = touchline.simulate(plan, seed=3, follower=follower)
    name = follower if isinstance(follower, str) else follower.__name__
    print(f"{name:<14}{1e3 * run.errors()['lateral_mean_m']:6.2f} mm on average, {run.duration_s:.2f} s")


# %% [markdown]
# A follower that fails stops the robot, and the run tells why.


# %%
def broken(state: touchline.FollowerState, ahead: touchline.FollowerAhead) -> tuple[float, float]:
    """Answer with nonsense."""
    return float("nan"), 0.0


failed = touchline.simulate(plan, follower=broken)
print(failed.reason)

# %% tags=["remove-cell"]
assert not failed.success and "not finite" in failed.reason
