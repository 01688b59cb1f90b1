"""Grids of small figures, one for each output; scripts fill them when they come into view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .markup import text


def panel_groups(kind: str, groups: Mapping[str, Sequence[tuple[int, str]]], what: str) -> str:
    """Groups of empty panels under headings, each panel by the place of its channel in the data and its label.

    ``kind`` is that of ``panelKinds`` in the scripts; ``what`` tells what they show, until the scripts say more.
    """
    return "".join(
        f'<h3>{text(title)}</h3><div class="panels">{"".join(_panel(kind, *each, what) for each in group)}</div>'
        for title, group in groups.items()
        if group
    )


def _panel(kind: str, place: int, label: str, what: str) -> str:
    """An empty figure; its caption and label follow what is chosen."""
    return (
        f'<figure class="panel" data-kind="{kind}" data-channel="{place}"><figcaption><strong>{text(label)}'
        '</strong> <span class="numbers"></span></figcaption>'
        f'<div class="plot" role="img" aria-label="{text(f"{what} of {label}")}"></div></figure>'
    )
