"""Reports: traces, runs and linear plants as JSON documents, terminal tables, HTML pages and report folders."""

from .report_folder import trace_document, write_report
from .trace_report_page import trace_page
from .trace_terminal import trace_table

__all__ = ["trace_document", "trace_page", "trace_table", "write_report"]
