"""Preprocessing of recordings for estimation: cleaning, measurement noise, clocks and the initial state."""
