"""Recordings: winch speeds and what sensors saw, from CSV, Parquet and MDF files."""
