"""``python -m tests.rig.lifelike FOLDER [--first N] KEYS...``: a folder with a case for each KEY.

Keys: none, friction, modulus+damping, swing and the like; 8:pulley asks for eight cables, 4p:pulley for a planar robot,
8r:pulley and 4r:pulley for a platform that turns, 8e:pulley for one of which nothing is uncertain or little.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.rig.lifelike.case import lifelike


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.rig.lifelike", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("keys", nargs="+")
    parser.add_argument("--first", type=int, default=1, help="number and seed of the first case")
    asked = parser.parse_args()
    for number, key in enumerate(asked.keys, start=asked.first):
        cables, _, hide = key.rpartition(":")
        place = asked.folder / f"{number:03d}-{hide}"
        if (place / "truth.json").exists():
            continue
        case = lifelike(
            number,
            [part for part in hide.split("+") if part != "none"],
            cables=int(cables.rstrip("pre")) if cables else None,
            planar=cables.endswith("p") if cables else None,
            turning=cables.endswith(("r", "e")),
            exact=cables.endswith("e"),
        )
        case.write(place)
        print(place, case.truth["size_of_hidden_rms"]["check"], case.truth["size_of_little_rms"]["check"], flush=True)


if __name__ == "__main__":
    main()
