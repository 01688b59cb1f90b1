"""Campaigns on real Dask clusters: workers and whole processes are lost, and every run has one row in the end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest

pytest.importorskip("distributed", reason='Dask is not installed: pip install "dask[distributed]" SALib')

import dask

from tautwire.campaigns import dask_cluster as clusters
from tautwire.campaigns.campaign_dataset import open_dataset, part_files, read_rows
from tautwire.campaigns.campaign_plan import UnfinishedError
from tautwire.campaigns.campaign_runner import run_campaign, run_count
from tautwire.campaigns.dask_cluster import WORKER_LOST, context_future, dashboard_message, dask_client
from tautwire.campaigns.plan_file import read_plan
from tautwire.cli import run as command
from tests.support.campaigns import AT_REST, moving, plan_file, read
from tests.support.clusters import bare_rows, cluster, rows_of, wait_for
from tests.support.faults import FAULT, build_faulty
from tests.support.robots import EXAMPLES


def silently(what: str, done: float) -> None:
    """Tells nobody."""


@pytest.mark.validate
def test_a_worker_killed_in_the_middle_costs_no_row_and_changes_none(tmp_path: Path) -> None:
    plan = read(tmp_path, moving(8))
    out = tmp_path / "out"
    with cluster(tmp_path) as (address, (_, *workers)), dask_client(address, 0) as client, open_dataset(out, plan):
        assert "http://127.0.0.1:" in dashboard_message(client)

        def kill(what: str, done: float) -> None:
            if done > 0.2 and workers[0].poll() is None:
                workers[0].kill()

        assert run_campaign(plan, out, client, kill) == run_count(plan) == 16
        assert workers[0].poll() is not None and workers[1].poll() is None
        assert run_campaign(plan, out, client, silently) == 0
    assert rows_of(out) == bare_rows(plan, tmp_path / "bare")
    series = read_rows(out, ["z"], "series")
    assert series.num_rows == 16 * 5


@pytest.mark.validate
def test_machine_code_runs_on_a_cluster_of_ours_alone(tmp_path: Path) -> None:
    plan, prefers_native = read(tmp_path, moving(8)), []
    with cluster(tmp_path, 1) as (address, _):
        for scheduler in (None, address):
            with dask_client(scheduler, 1) as client:
                prefers_native.append(context_future(client, plan, {}).result().bundle.prefers_native)
    assert prefers_native == [True, False]


@pytest.mark.validate
def test_a_cluster_of_ours_spends_little_beside_runs() -> None:
    with dask_client(None, 1) as client:
        (found,) = client.run(lambda: {name: dask.config.get(name) for name in clusters.LOW_OVERHEAD_CONFIG}).values()
    assert found == clusters.LOW_OVERHEAD_CONFIG and not found["distributed.worker.profile.enabled"]


def test_the_dashboard_of_ours_needs_a_library_here_that_of_others_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "find_spec", lambda name: None)
    link = "http://10.0.0.5:8787/status"
    assert "needs bokeh" in dashboard_message(SimpleNamespace(cluster=object(), dashboard_link=link))
    assert dashboard_message(SimpleNamespace(cluster=None, dashboard_link=link)) == f"Dask's dashboard: {link}"


@pytest.mark.validate
def test_the_same_rows_come_from_one_worker_and_from_two(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    results = []
    for count in (1, 2):
        out = tmp_path / f"out_{count}"
        with dask_client(None, count) as client, open_dataset(out, plan):
            assert len(client.nthreads()) == count
            run_campaign(plan, out, client, silently)
        results.append(rows_of(out))
    assert results[0] == results[1] == bare_rows(plan, tmp_path / "bare")


@pytest.mark.validate
@pytest.mark.skipif(sys.platform == "win32", reason="needs process groups")
def test_a_campaign_that_was_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    file, out = plan_file(tmp_path, moving(16)), tmp_path / "out"
    call = [
        sys.executable,
        "-m",
        "tautwire.cli",
        "campaign",
        str(file),
        "--out",
        str(out),
        "--workers",
        "2",
    ]
    process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for(lambda: process.poll() is not None or bool(list((out / "runs").glob("*.parquet"))))
    # As from a terminal, to all processes of the group.
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 1 and "the same command resumes it" in said
    assert "Traceback" not in said
    written = {part: part.stat().st_mtime_ns for part in part_files(out)}
    before = sum(pq.read_metadata(part).num_rows for part in written)
    assert 0 < before < 32
    again = subprocess.run(call, capture_output=True, text=True, timeout=300, check=True)
    assert f"32 runs, {32 - before} of them now, 0 failed" in again.stdout
    assert {part: part.stat().st_mtime_ns for part in written} == written
    assert len(rows_of(out)) == 32
    assert (out / "index.html").exists() and not list(out.rglob("*.partial"))


@pytest.mark.validate
def test_a_run_that_ends_its_workers_is_a_row_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build_faulty(tmp_path)
    file = plan_file(tmp_path, moving(1).replace('method = "sobol"\ncount = 1', 'method = "random"\ncount = 1'))
    robot = tmp_path / "robot.toml"
    robot.write_text(robot.read_text(encoding="utf-8") + '\n[fmu]\nwinch_2 = "Faulty.fmu"\n', encoding="utf-8")
    monkeypatch.setenv(FAULT, "winch_2:step:leave:0.05")
    plan, out = read_plan(file), tmp_path / "out"
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        dask_client(None, 1) as client,
        open_dataset(out, plan),
    ):
        assert run_campaign(plan, out, client, silently) == 2
    rows = rows_of(out)
    assert [row["failure"] for row in rows] == [WORKER_LOST, WORKER_LOST]
    assert rows[0]["platform.mass"] is not None


@pytest.mark.validate
def test_a_scheduler_that_is_lost_leaves_what_came_until_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = read(tmp_path, moving(16))
    out = tmp_path / "out"
    monkeypatch.setattr(clusters, "CONNECT", 2.0)
    with cluster(tmp_path, 1) as (address, (scheduler, _)), dask_client(address, 0) as client, open_dataset(out, plan):

        def end(what: str, done: float) -> None:
            if done > 0.1:
                scheduler.kill()

        message = r"scheduler was lost after \d+ of 32 runs; the same command resumes it"
        with pytest.raises(UnfinishedError, match=message):
            run_campaign(plan, out, client, end)
    assert part_files(out)


@pytest.mark.validate
def test_recordings_are_traced_each_to_a_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    season = tmp_path / "season"
    season.mkdir()
    lines = (EXAMPLES / "three" / "fit.csv").read_text(encoding="utf-8").splitlines()
    (season / "monday.csv").write_text("\n".join(lines[:400]), encoding="utf-8")
    (season / "tuesday.csv").write_text("time,winch_speed_1\n0.0,0.0\n", encoding="utf-8")
    file = plan_file(tmp_path, 'robot = "robot.toml"\n[trace]\nrecordings = "season"\n')
    out = tmp_path / "out"
    assert command(["campaign", str(file), "--out", str(out), "--workers", "1"]) == 0
    assert "2 runs, 2 of them now, 1 failed" in capsys.readouterr().out
    monday, tuesday = rows_of(out)
    assert monday["recording"] == "monday.csv" and monday["verdict"] in ("effects", "none", "discovered", "unexplained")
    assert "RecordingError" in str(tuesday["failure"]) and tuesday["recording"] == "tuesday.csv"
    assert "monday.csv" in (out / "index.html").read_text(encoding="utf-8")


def test_an_address_where_nothing_answers_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = plan_file(tmp_path, AT_REST)
    monkeypatch.setattr(clusters, "CONNECT", 0.5)
    arguments = ["campaign", str(file), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9"]
    assert command(arguments) == 2
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err
