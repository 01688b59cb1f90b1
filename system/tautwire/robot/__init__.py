"""Robots: what a robot file says, read, checked and written again."""
