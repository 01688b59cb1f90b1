"""A robot's FMUs: built, mended for C hosts, and the slots that FMUs of others can take."""
