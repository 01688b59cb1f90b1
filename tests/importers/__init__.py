"""The same run of the paper's robot in other people's importers, each in an environment of its own.

``by_*.py`` are the clients: scripts that know their importer and ``run.json``, and nothing of Tautwire.
"""
