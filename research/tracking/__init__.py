"""The study of cubic paths and trajectory tracking: its set-up reproduced, and ours beside it."""
