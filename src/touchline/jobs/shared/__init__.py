"""Several robots on one template: planned together, kept apart, and evaluated together."""
