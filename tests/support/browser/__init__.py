"""A real browser for tests of pages: Debian's chromium, driven by selenium."""
