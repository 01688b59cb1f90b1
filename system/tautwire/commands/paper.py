"""The paper that the project implements, claim by claim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .shared import AsJson, Quiet, Voice, progress_bar


def paper(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where claims.html, claims.json and the figures go.")],
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Recompute the paper by co-simulation, claim by claim.

    Draws its figures anew, and says of each number that the text claims whether it comes out.

    Example: tautwire paper --out paper/
    """
    from ..output import folder_in_place
    from ..paper import write_paper

    voice = Voice(as_json, quiet)
    with folder_in_place(out) as scratch, progress_bar(voice) as tell:
        found = write_paper(scratch, tell)
    counts = dict(found.counts)
    voice.note(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    paths = [out / "claims.html", out / "claims.json"]
    voice.result(paths, {"claims": len(found.entries), "verdicts": counts, "page": paths[0], "ledger": paths[1]})
    voice.next(f"open {paths[0]} in a browser")
