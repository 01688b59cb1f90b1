"""Our FMUs in other people's importers: the paper's ramp, each held against the robot as one model."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from tautwire.fmus.pythonfmu_builder import with_immediate_return
from tests.importers.harness import IMPORTERS, Importer, NotInstallableError, exact_end, prepare, run_client
from tests.importers.ramps import LIMIT, RAMP, acceleration, speed, winches
from tests.support.robots import paper_robot


@pytest.fixture(scope="module", params=["python", "native"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run as all clients find it, with FMUs of either kind."""
    place = tmp_path_factory.mktemp("importers")
    prepare(paper_robot(), place, native=request.param == "native")
    return place


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return exact_end(paper_robot())


@pytest.mark.validate
@pytest.mark.parametrize("importer", IMPORTERS, ids=lambda importer: Path(importer.client).stem)
@pytest.mark.parametrize(("folder", "step"), [("python", 0.01), ("native", 0.001)], indirect=["folder"])
def test_an_importer_ends_where_the_robot_ends(
    importer: Importer, step: float, folder: Path, exact: np.ndarray
) -> None:
    try:
        result = run_client(importer, folder, step)
    except NotInstallableError as reason:
        pytest.skip(str(reason))
    assert result["steps"] == round(7.0 / step)
    error = 1e3 * np.linalg.norm(np.array(result["position"]) - exact)
    assert np.isfinite(error)
    assert error <= importer.bounds[step], f"{error:.3g} mm"


@pytest.mark.validate(but=["python"])
def test_the_driver_ends_with_its_process_as_our_fmus_do(folder: Path) -> None:
    with zipfile.ZipFile(folder / "driver.fmu") as packed:
        library = packed.read("binaries/linux64/Driver.so")
    assert with_immediate_return(library) == library


def test_the_winches_ramp_to_a_metre_a_second() -> None:
    assert [speed(rate, 7.0) for rate in RAMP] == [1.0, 1.0, -1.0]
    assert winches(1.0)["winch_speed_2"] == 0.25
    assert winches(2.0)["winch_acceleration_3"] == -0.25


@pytest.mark.parametrize("rate", RAMP)
def test_a_corner_is_reached_in_spite_of_rounding(rate: float) -> None:
    corner = LIMIT / abs(rate)
    assert acceleration(rate, corner - 1e-6) == rate
    assert acceleration(rate, corner - 1e-12) == 0.0
