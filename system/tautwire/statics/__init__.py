"""The robot at rest: tensions, their distribution, and where a wrench can be held."""
