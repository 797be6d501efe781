# %% [markdown]
# # Your own log
#
# Any MCAP file or ROS 2 bag as arrays. Here the log is one that is recorded first.

# %%
import tempfile
from pathlib import Path

import numpy as np

import touchline

folder = Path(tempfile.mkdtemp())
run = touchline.simulate("study-square", seed=5, record=folder / "drive.mcap")

# %%
log = touchline.Recording(folder / "drive.mcap")
print(log)
for name, topic in log.topics.items():
    if topic.rate_hz:
        print(f"{name:<28}{topic.type:<34}{topic.messages:>7} messages, {topic.rate_hz:.0f} Hz")

# %% [markdown]
# A topic is a structured array with a field for each field of its messages.

# %%
imu = log["imu/data_raw"].array()
print(f"gravity by the accelerometer: {imu['linear_acceleration.z'].mean():.3f} m/s²")

# %% [markdown]
# Topics of different rates in one table: to each odometry message the last true one until then.

# %%
rows = log.frame(["odometry/filtered", "truth/odometry"], kind="numpy")
off = np.hypot(
    rows["pose.pose.position.x"] - rows["truth/odometry.pose.pose.position.x"],
    rows["pose.pose.position.y"] - rows["truth/odometry.pose.pose.position.y"],
)
print(f"the estimate is off by {1e3 * np.sqrt(np.nanmean(off**2)):.1f} mm (RMS)")

# %% [markdown]
# A recorded session is a regression test: it is planned and driven again from the recording alone, and compared bit by
# bit.

# %%
check = touchline.check(folder / "drive.mcap", workers=1)
print(check)

# %% tags=["remove-cell"]
assert check.passed
