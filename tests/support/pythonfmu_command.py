"""FMUs as pythonfmu's own command builds them."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from tautwire.fmus.pythonfmu_builder import patch_wrapper_exit


def build_by_command(script: Path, target: Path, *resources: Path) -> Path:
    """The FMU of ``script`` at ``target``.

    Building leaves modules behind, so another process does it. The wrapper is patched as that of our FMUs is: its
    library writes into freed memory as a process exits, which now and then ends a client with an abort.
    """
    with tempfile.TemporaryDirectory() as scratch:
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", scratch, "--no-external-tool"]
        command += [str(resource) for resource in resources]
        done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
        assert done.returncode == 0, done.stderr[-1500:]
        (built,) = Path(scratch).glob("*.fmu")
        patch_wrapper_exit(built, target)
    return target
