"""The study to beat, for comparison only: its two planners as described, and how all three are measured."""
