"""Study of cubic paths and trajectory tracking: its set-up reproduced, and compared with ours."""
