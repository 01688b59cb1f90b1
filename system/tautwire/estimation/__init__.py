"""System identification: finds what a model lacks from recordings, or says that it does not know."""

from .identification import trace
from .time_limit import TimeLimit
from .trace_result import Candidate, Comparison, Errors, Estimate, FoundEffect, Trace
from .worker_pool import processors

__all__ = ["Candidate", "Comparison", "Errors", "Estimate", "FoundEffect", "TimeLimit", "Trace", "processors", "trace"]
