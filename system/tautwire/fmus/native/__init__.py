"""Native FMUs: the laws as C source, traced from the same Python functions, compiled for any platform."""
