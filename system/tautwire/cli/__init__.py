"""The command line: ``application`` runs it, and one module holds each group of commands."""

from .application import COMMANDS, app, main, run

__all__ = ["COMMANDS", "app", "main", "run"]
