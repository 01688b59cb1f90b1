"""Hints for lines of robot files that are not TOML, as other formats, locales and spreadsheets write them."""

from __future__ import annotations

import re

_NUMBER = r"[-+]?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?"
_KEY = r"\s*(?P<key>[A-Za-z_][\w.]*)"
_TABLE = re.compile(r"\s*\[(?P<name>[\w.]+)\]")
_SEVERAL_TABLES = re.compile(r"cable|formula|effect\.\w+")
_LINES = (
    (rf"{_KEY}\s*=\s*(?P<whole>[-+]?[0-9]+),(?P<part>[0-9]+)$", "write a decimal point: {key} = {whole}.{part}"),
    (
        rf"{_KEY}\s*=\s*(?P<value>{_NUMBER})\s*[^\W\d_][\w/^*.\u00b2\u00b3 ]*$",
        "write the number alone, {key} = {value}, and what it is in behind a #",
    ),
    (rf"{_KEY}\s*:\s*(?P<value>[^=]+)$", "write {key} = {value}"),
    (
        rf"{_KEY}\s*=\s*[\u201c\u201d\u201e\u2018\u2019](?P<value>[^\"]*?)[\u201c\u201d\u2018\u2019]$",
        'write {key} = "{value}"',
    ),
    (rf"{_KEY}\s*=\s*(?P<value>[A-Za-z][\w-]*)$", 'write {key} = "{value}", in quotation marks'),
    (rf"{_KEY}\s*=\s*\"[^\"]*$", "close the quotation mark"),
    (rf"{_KEY}\s*=\s*{_NUMBER}\s*[-+*/x\u00b7^].*$", "write {key} as one number, such as 1.022e11"),
)
DEFAULT_HINT = "correct this line"


def hint_for_line(text: str, line: int, reason: str) -> str:
    """What to write in a line, from 1, of a text that is not TOML for the parser's reason."""
    lines = text.splitlines()
    if text.lstrip().startswith(("{", "<")):
        return "write it in TOML, with lines such as mass = 300.0; tautwire new NAME writes a file to fill in"
    if "Unclosed array" in reason:
        return f"close the list that begins in line {_line_of_open_list(lines, line)} with ]"
    shown = lines[line - 1] if 0 < line <= len(lines) else ""
    table = _TABLE.match(shown)
    if table is not None and ("declare" in reason or "mutate" in reason):
        name = table.group("name")
        is_one_of_several = _SEVERAL_TABLES.fullmatch(name) is not None
        return f"write [[{name}]] above each" if is_one_of_several else f"write all keys of [{name}] into one table"
    if "overwrite" in reason:
        return "the key stands twice, keep one of the two"
    statement = shown.partition("#")[0].rstrip()
    for pattern, hint in _LINES:
        match = re.match(pattern, statement)
        if match is not None:
            return hint.format(**match.groupdict())
    return DEFAULT_HINT


def _line_of_open_list(lines: list[str], line: int) -> int:
    """The last line up to one, from 1, that opens more lists than it closes and is no header of a table."""
    for number in range(min(line, len(lines)), 0, -1):
        code = lines[number - 1].partition("#")[0]
        if "=" in code and code.count("[") > code.count("]"):
            return number
    return line
