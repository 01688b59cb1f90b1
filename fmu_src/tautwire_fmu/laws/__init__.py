"""Physical laws, written once: plain functions of scalars and small tuples, with the mathematics handed in."""
