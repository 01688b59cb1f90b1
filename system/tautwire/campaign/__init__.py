"""Many runs of one robot: samples and sweeps of its numbers, over paths and controllers, and folders of recordings."""
