# %% [markdown]
# # A first hour
#
# From a drawing to a painted field, and what changes if something changes. In a checkout, install Touchline into an
# environment of its own:
#
# ```
# python3 -m venv .venv
# .venv/bin/pip install -c constraints.txt '.[standard]'
# ```
#
# Then run the cells of this file in an editor or in Jupyter, or all of it at once:
# `.venv/bin/python docs/tutorials/first_hour.py`. The first time takes minutes, because what computes is compiled.

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
print(f"{plan.length_m:.1f} m in {plan.duration_s:.1f} s, {len(path)} poses")
path[:3]

# %%
painted = plan.segments[plan.segments["working"]]
print("painted in this order:", *painted["id"], sep="\n  ")

# %% [markdown]
# Drive it. The robot's receiver, gyro, encoders, tyres and delays are those of a real one; the seed decides the noise.
# A run shows itself as a picture, too: the paint, coloured by its distance from the template.

# %%
run = touchline.simulate(plan, seed=7)
run

# %%
for name, value in run.errors().items():
    print(f"{name:<18}{value:.5f}")

# %% [markdown]
# Look at the drive tick by tick: the true distance of the nozzle from its path while the valve was open, and the
# distance that the robot believed in.

# %%
frame = run.frame(kind="numpy")
painting = frame[frame["valve_open"]]
for name in ("lateral_error_m", "lateral_belief_m"):
    print(f"{name:<18}{1e3 * abs(painting[name]).mean():.1f} mm on average")

# %% [markdown]
# Change something and compare, on a smaller field: a receiver with twice the noise, two followers, three seeds each.
# The table has a line for each combination; `table.rows` and `table.frame()` have one for each run.

# %%
settings = {"gnss.white_m": [0.0047, 0.0094], "follower": ["mpc", "pure-pursuit"]}
table = touchline.sweep("study-square", seeds=3, settings=settings, workers=1)
table

# %% tags=["remove-cell"]
assert run.success and table.rows["success"].all()
