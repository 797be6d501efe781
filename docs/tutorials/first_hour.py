# %% [markdown]
# # A first hour
#
# From a drawing to a painted field, and what changes if something changes. Run the cells of this file in an editor, or
# the whole of it: `python docs/tutorials/first_hour.py`.

# %%
import touchline

touchline.templates()

# %% [markdown]
# Plan the lines of a tennis court for the shipped line marker. In a notebook the plan shows itself as a picture.

# %%
plan = touchline.plan("tennis", paint_speed_mps=0.8)
plan

# %% [markdown]
# The plan is an array: the pose of the robot every 2 cm, with times and speeds.

# %%
path = plan.path(step_m=0.02)
print(f"{plan.length_m:.1f} m in {plan.duration_s:.1f} s, {len(path)} rows of {path.dtype.names}")

# %%
painted = plan.segments[plan.segments["working"]]
print("painted in this order:", ", ".join(painted["id"]))

# %% [markdown]
# Drive it. The robot's receiver, gyro, encoders, tyres and delays are those of a real one; the seed decides the noise.

# %%
run = touchline.simulate(plan, seed=7)
print(run)
print(run.errors())

# %% [markdown]
# Look at the drive: where the nozzle was, where the robot believed to be, and when the valve was open.

# %%
frame = run.frame(kind="numpy")
painting = frame[frame["valve_open"]]
print(f"true error of the nozzle while painting: {1e3 * abs(painting['lateral_error_m']).mean():.1f} mm on average")
print(f"error as the robot believes: {1e3 * abs(painting['lateral_belief_m']).mean():.1f} mm")

# %%
run.plot()

# %% [markdown]
# Change something and compare: a receiver with twice the noise, two followers, three seeds each.

# %%
settings = {"gnss.white_m": [0.0047, 0.0094], "follower": ["mpc", "pure-pursuit"]}
table = touchline.sweep(plan, seeds=3, settings=settings, workers=1)
for line in table.summary():
    print(line["gnss.white_m"], line["follower"], f"{1e3 * line['lateral_error_mean_m_mean']:.2f} mm")

# %%
if __name__ == "__main__":
    assert run.success and table.rows["success"].all()
