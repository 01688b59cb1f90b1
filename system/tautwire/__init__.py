"""Cable-driven parallel robots as FMI components, and a tracer that finds what their model lacks."""
