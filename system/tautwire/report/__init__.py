"""What a trace found, shown: as a JSON document, on the terminal, as a page and as a folder of all."""

from .document import trace_document
from .folder import write_report
from .page import trace_page
from .table import trace_table

__all__ = ["trace_document", "trace_page", "trace_table", "write_report"]
