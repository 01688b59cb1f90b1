"""Where the residual sits: each FMU cut at its measured ports, before any effect is fitted."""
