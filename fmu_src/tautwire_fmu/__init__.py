"""Code inside an FMU: the physical laws and the FMI slaves that wrap them; the standard library only."""
