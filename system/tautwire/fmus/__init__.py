"""A robot's FMUs: built, patched for C hosts, and the slots that user FMUs can take."""
