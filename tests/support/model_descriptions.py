"""FMUs with other model descriptions, as other tools may write them."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from tautwire.fmus.packaging import RobotFmus


def with_descriptions(fmus: RobotFmus, folder: Path, changes: Mapping[str, str]) -> RobotFmus:
    """The same FMUs, with texts replaced in their model descriptions."""

    def changed(path: Path) -> Path:
        with zipfile.ZipFile(path) as archive, zipfile.ZipFile(folder / path.name, "w") as copy:
            for name in archive.namelist():
                content = archive.read(name)
                for old, new in changes.items() if name == "modelDescription.xml" else ():
                    content = content.replace(old.encode(), new.encode())
                copy.writestr(name, content)
        return folder / path.name

    return replace(fmus, platform=changed(fmus.platform), cables=tuple(map(changed, fmus.cables)))
