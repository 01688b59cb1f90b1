"""Reports: traces, runs and linear plants as JSON documents, terminal tables, HTML pages and report folders."""

from .document import trace_document
from .folder import write_report
from .page import trace_page
from .table import trace_table

__all__ = ["trace_document", "trace_page", "trace_table", "write_report"]
