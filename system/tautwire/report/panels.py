"""Grids of figure panels, one for each output; scripts draw them when they come into view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .markup import escape_text


def panel_groups(kind: str, groups: Mapping[str, Sequence[tuple[int, str]]], description: str) -> str:
    """Groups of empty panels under headings, each panel given by its channel's index in the data and its label.

    ``kind`` is a key of ``panelKinds`` in the scripts; ``description`` labels the panels until the scripts replace it.
    """
    return "".join(
        f'<h3>{escape_text(title)}</h3><div class="panels">{"".join(_panel_html(kind, *each, description) for each in group)}</div>'
        for title, group in groups.items()
        if group
    )


def _panel_html(kind: str, channel_index: int, label: str, description: str) -> str:
    """An empty figure; scripts fill its caption and label."""
    return (
        f'<figure class="panel" data-kind="{kind}" data-channel="{channel_index}"><figcaption><strong>{escape_text(label)}'
        '</strong> <span class="numbers"></span></figcaption>'
        f'<div class="plot" role="img" aria-label="{escape_text(f"{description} of {label}")}"></div></figure>'
    )
