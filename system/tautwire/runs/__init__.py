"""A robot's FMUs wired together: as a co-simulation whose rows go to files, and as an SSP archive."""
