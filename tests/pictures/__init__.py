"""The pictures of README and docs that come from runs."""
