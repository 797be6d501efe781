"""Recordings of jobs, by the bridge or in this process."""
