"""CasADi functions in machine code."""
