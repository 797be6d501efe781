"""The study to beat: its two planners as it describes them, and how all three planners are measured. For comparison only."""
