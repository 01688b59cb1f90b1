"""A hook of MkDocs: names that docstrings refer to by a role, as ``:func:`` does, are shown as code without it."""

import re
from typing import Any


def on_page_content(html: str, **_: Any) -> str:
    """The page without the roles' names, which Markdown leaves before the code."""
    return re.sub(r":(?:attr|class|data|func|meth|mod):(?=<code>)", "", html)
