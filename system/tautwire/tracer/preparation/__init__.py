"""A recording made ready for the tracer: what its sensors are worth, and how its run begins."""
