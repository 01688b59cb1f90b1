"""Recordings: winch speeds and sensor signals, from CSV, Parquet, MDF and MATLAB files and ROS bags."""
