"""Recordings: winch speeds and sensor signals, from CSV, Parquet and MDF files."""
