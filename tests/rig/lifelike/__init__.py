"""Recordings of robots as they are: everything a little wrong, much that shakes a little, and one thing hidden."""
