"""System identification: finds what a model lacks from recordings, or says that it does not know."""

from .tracing import trace
from .verdict import Candidate, Comparison, Errors, Estimate, FoundEffect, Trace
from .workers import processors

__all__ = ["Candidate", "Comparison", "Errors", "Estimate", "FoundEffect", "Trace", "processors", "trace"]
