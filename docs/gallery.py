# %% [markdown]
# # Gallery
#
# Pictures, each with the lines that make it.

# %%
import matplotlib.pyplot as plt

import touchline

# %% [markdown]
# ## Plan of a soccer pitch
#
# The robot marks with its side, so that its path lies beside the lines.

# %%
pitch = touchline.plan("soccer-11")
pitch.plot(plt.figure(figsize=(8, 4.5), layout="constrained").subplots())
plt.show()

# %% [markdown]
# ## Drive with its errors
#
# Paint of a tennis court, coloured by its distance from the template, and the error over time: as it is, and as the
# robot believes it to be.

# %%
run = touchline.simulate("tennis", seed=7)
run.plot(plt.figure(figsize=(9, 5), layout="constrained").subplots())
plt.show()

# %%
drive = run.frame(kind="numpy", rate_hz=10)
error = plt.figure(figsize=(9, 3), layout="constrained").subplots()
error.plot(drive["time_s"], 1e3 * drive["lateral_error_m"], label="true")
error.plot(drive["time_s"], 1e3 * drive["lateral_belief_m"], label="believed")
error.set(xlabel="time (s)", ylabel="lateral error (mm)")
error.legend()
plt.show()

# %% [markdown]
# ## Area covered
#
# A roller covers a pan of clay in lanes, and no part of it may leave the pan: what it misses is red.

# %%
outline = [[0, 0], [30, 0], [30, 16], [0, 16]]
pan = {"name": "pan", "areas": [{"id": "clay", "outline": outline}]}
plan = touchline.plan(pan, vehicle="clay-roller", area_method="zigzag")
touchline.simulate(plan, seed=1).plot(plt.figure(figsize=(9, 6)).subplots())
plt.show()

# %% [markdown]
# ## Team that spreads over an area

# %%
team = touchline.fleet(6, seed=3)
axes = plt.figure(figsize=(6, 5), layout="constrained").subplots()
axes.plot(team.place_m[:, :, 0], team.place_m[:, :, 1], linewidth=1)
axes.plot(team.place_m[-1, :, 0], team.place_m[-1, :, 1], "ko")
axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
plt.show()

# %% [markdown]
# ## Sweep over receivers and followers

# %%
settings = {"gnss.white_m": [0.005, 0.02], "follower": ["mpc", "pure-pursuit"]}
rows = touchline.sweep("study-square", seeds=3, settings=settings, workers=1).rows
axes = plt.figure(figsize=(6, 4), layout="constrained").subplots()
for follower in settings["follower"]:
    its = rows[rows["follower"] == follower]
    noise_mm, error_mm = 1e3 * its["gnss.white_m"], 1e3 * its["lateral_error_mean_m"]
    axes.plot(noise_mm, error_mm, "o", label=follower)
axes.set(xlabel="white noise of the receiver (mm)", ylabel="mean lateral error (mm)")
axes.legend()
plt.show()

# %% [markdown]
# ## Recorded session
#
# Any MCAP file or ROS 2 bag is read in the same way.

# %%
plt.rcParams["axes.formatter.useoffset"] = False
log = touchline.Recording("../examples/sessions/square.mcap")
imu, fixes = log["imu/data_raw"].array(), log["gnss/fix"].array()
figure, (turning, place) = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
turning.plot(imu["time_s"], imu["angular_velocity.z"])
turning.set(xlabel="time (s)", ylabel="yaw rate (rad/s)")
place.plot(fixes["longitude"], fixes["latitude"], ".")
place.set(xlabel="longitude (°)", ylabel="latitude (°)")
plt.show()

# %% [markdown]
# ## Operator's console
#
# `touchline up`, then `python docs/console_picture.py docs/images/console.svg`:
#
# ![The console while a pitch is painted](images/console.svg)
