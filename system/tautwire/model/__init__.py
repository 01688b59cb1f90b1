"""The robot as one model in memory, from the laws that the FMUs carry."""
