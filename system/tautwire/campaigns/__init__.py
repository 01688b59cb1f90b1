"""Simulation campaigns: many runs of one robot over a parameter space, paths and controllers, or many traces."""
