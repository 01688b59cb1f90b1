"""What travels inside an FMU: the laws and the slaves that wrap them; the standard library only."""
