"""The command ``paper``: reproduction of the paper that the project implements, claim by claim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .shared import AsJson, CommandOutput, Quiet, progress_bar


def paper(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where claims.html, claims.json and the figures go.")],
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Recompute the paper by co-simulation, claim by claim.

    Draws its figures anew, and says of each number that the text claims whether it comes out.

    Example: tautwire paper --out paper/
    """
    from ..output import atomic_folder
    from ..paper import write_paper

    output = CommandOutput(as_json, quiet)
    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        result = write_paper(scratch, progress)
    counts = dict(result.counts)
    output.note(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    paths = [out / "claims.html", out / "claims.json"]
    output.result(paths, {"claims": len(result.entries), "verdicts": counts, "page": paths[0], "ledger": paths[1]})
    output.suggest_next(f"open {paths[0]} in a browser")
