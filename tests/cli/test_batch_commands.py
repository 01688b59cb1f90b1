"""``tautwire campaign`` on a cluster of the user's: command, scheduler and workers each a process of its own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple
from urllib.request import urlopen

import pyarrow.parquet as pq
import pytest

pytest.importorskip("distributed", reason='Dask is not installed: pip install "dask[distributed]" SALib')

from distributed import Client

from tautwire.campaigns.plan_file import read_plan
from tautwire.provenance import PROVENANCE_KEY
from tests.support.campaigns import moving, plan_file
from tests.support.clusters import bare_rows, cluster, rows_of

# Only what the command writes is bounded: what workers keep of FMUs is theirs.
LIMITED = """
import resource, sys
from tautwire.cli.application import run

# Python would leave a module's bytecode cut off.
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(run(sys.argv[2:]))
"""


class Users(NamedTuple):
    """A cluster of the user's: the scheduler's ``address``, and the ``folder`` in which each worker has its own."""

    address: str
    folder: Path

    def campaign(self, file: Path, out: Path, largest: int | None = None) -> subprocess.CompletedProcess[str]:
        """What the command says; it cannot write files larger than ``largest`` bytes."""
        start = ["-m", "tautwire.cli"] if largest is None else ["-c", LIMITED, str(largest)]
        arguments = ["campaign", str(file), "--out", str(out), "--scheduler", self.address]
        return subprocess.run(
            [sys.executable, *start, *arguments], capture_output=True, text=True, timeout=120, check=False
        )


@pytest.fixture(scope="module")
def users(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Users]:
    folder = tmp_path_factory.mktemp("cluster")
    with cluster(folder, 2, dashboard=True) as (address, _):
        yield Users(address, folder / "local")


@pytest.mark.validate
def test_two_workers_of_the_users_make_what_a_bare_loop_makes(users: Users, tmp_path: Path) -> None:
    file, out = plan_file(tmp_path, moving(4)), tmp_path / "out"
    completed = users.campaign(file, out)
    assert completed.returncode == 0, completed.stderr
    assert completed.stdout.splitlines() == [
        "8 runs, 8 of them now, 0 failed",
        *(str(out / name) for name in ("runs", "summary.json", "index.html")),
    ]
    page, rows = out / "index.html", out / "runs"
    assert completed.stderr.splitlines()[-1] == f"next: open {page}; pandas.read_parquet('{rows}') has one row per run"
    assert rows_of(out) == bare_rows(read_plan(file), tmp_path / "bare")
    document = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert document["failed"] == 0
    assert document["provenance"]["inputs"][str(file)] == sha256(file.read_bytes()).hexdigest()
    parts = [json.loads(pq.read_schema(part).metadata[PROVENANCE_KEY.encode()]) for part in rows.glob("*.parquet")]
    assert parts and all(part["inputs"] == document["provenance"]["inputs"] for part in parts)
    assert document["provenance"]["inputs"][str(file)] in page.read_text(encoding="utf-8")
    again = users.campaign(file, out)
    assert (again.returncode, again.stdout.splitlines()[0]) == (0, "8 runs, 0 of them now, 0 failed")


@pytest.mark.validate
def test_the_dashboard_is_where_the_command_says(users: Users, tmp_path: Path) -> None:
    pytest.importorskip("bokeh", reason="the dashboard needs bokeh")
    completed = users.campaign(plan_file(tmp_path, moving(1)), tmp_path / "out")
    (link,) = re.findall(r"^Dask's dashboard: (http://127\.0\.0\.1:[0-9]+/status)$", completed.stderr, re.MULTILINE)
    with urlopen(link, timeout=30) as page:
        assert page.status == 200 and b"Dask" in page.read()


@pytest.mark.validate
def test_fmus_reach_each_worker_once(users: Users, tmp_path: Path) -> None:
    def unpacked() -> dict[Path, tuple[int, int]]:
        """All that each worker keeps of FMUs, with the folder that changes where something is unpacked into it."""
        kept = [path for place in users.folder.rglob("tautwire-fmus") for path in (place, *place.rglob("*"))]
        return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in kept}

    def campaign(name: str, seed: int) -> None:
        text = moving(4).replace("seed = 7", f"seed = {seed}")
        assert users.campaign(plan_file(tmp_path, text), tmp_path / name).returncode == 0

    campaign("first", 7)
    before = unpacked()
    listed = sorted(path.name for path in before if path.suffix == ".fmu")
    assert listed == sorted([*(f"cable_{i}.fmu" for i in (1, 2, 3)), "platform.fmu"] * 2)
    with Client(users.address, set_as_default=False) as client:
        client.run(lambda dask_worker: dask_worker.transfer_incoming_log.clear())
        campaign("second", 8)
        logs = client.run(lambda dask_worker: [list(each["keys"]) for each in dask_worker.transfer_incoming_log])
    # The worker that built them needs none; the other one takes them once for all its runs.
    received = sorted(sum(key.startswith("build_context") for keys in log for key in keys) for log in logs.values())
    assert received == [0, 1]
    assert unpacked() == before


@pytest.mark.validate
@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
def test_after_a_full_disk_the_same_command_gives_all_rows(users: Users, tmp_path: Path) -> None:
    file, out = plan_file(tmp_path, moving(2)), tmp_path / "out"
    full = users.campaign(file, out, largest=2_000)
    assert full.returncode == 1 and "File too large" in full.stderr and "Traceback" not in full.stderr
    assert not (out / "index.html").exists() and not list(out.rglob("*.partial"))
    again = users.campaign(file, out)
    assert (again.returncode, again.stdout.splitlines()[0]) == (0, "4 runs, 4 of them now, 0 failed")
    assert rows_of(out) == bare_rows(read_plan(file), tmp_path / "bare")
    assert (out / "index.html").exists() and (out / "summary.json").exists()
