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
pitch.plot(plt.figure(figsize=(8, 4.5), layout="constrained").subplots(), colour="speed")
plt.show()

# %% [markdown]
# ## Drive with its errors
#
# Paint of a tennis court, coloured by its distance from the template, and the error over time: as it is, and as the
# robot believes it to be.

# %%
run = touchline.simulate("tennis", seed=7)
figure, (paint, error) = plt.subplots(2, figsize=(8, 7), height_ratios=(3, 2), layout="constrained")
run.plot(paint)
drive = run.frame(kind="numpy", rate_hz=10)
error.plot(drive["time_s"], 1e3 * drive["lateral_error_m"], label="true")
error.plot(drive["time_s"], 1e3 * drive["lateral_belief_m"], label="believed")
error.set(xlabel="time (s)", ylabel="lateral error (mm)")
error.legend()
plt.show()

# %% [markdown]
# ## Area rolled

# %%
rolled = touchline.simulate(touchline.plan("salt-pan", vehicle="clay-roller"), seed=1)
rolled.plot(plt.figure(figsize=(8, 5), layout="constrained").subplots())
plt.show()

# %% [markdown]
# ## Team that spreads over an area

# %%
team = touchline.fleet(10, seed=3)
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
    axes.plot(1e3 * its["gnss.white_m"], 1e3 * its["lateral_error_mean_m"], "o", alpha=0.6, label=follower)
axes.set(xlabel="white noise of the receiver (mm)", ylabel="mean lateral error (mm)")
axes.legend()
plt.show()

# %% [markdown]
# ## Recorded session
#
# Any MCAP file or ROS 2 bag is read in the same way.

# %%
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
