"""Blind benchmark of the tracer on recordings of the rig: ``make bench-trace``."""
