"""Published studies reproduced for comparison: their methods as described, and measurements of theirs and ours."""
