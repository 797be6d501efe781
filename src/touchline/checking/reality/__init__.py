"""Statistics of a log's errors, and the emulated scenario that errs as the log does."""
