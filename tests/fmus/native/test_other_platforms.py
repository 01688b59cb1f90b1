"""Native FMUs on platforms that this machine only emulates: Windows by wine, Linux on ARM by QEMU."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from tautwire.fmus.native.c_toolchain import PLATFORMS, find_toolchain
from tautwire.fmus.packaging import build_fmus, build_whole_fmu
from tests.support.c_programs import Host, compile_host, extracted, numbers, robot_plan, unpacked, whole_robot_plan
from tests.support.effect_cases import SEVERAL
from tests.support.effects import with_effects
from tests.support.robots import LIMITED, paper_robot, with_winch

# m, after three seconds: mathematical functions of systems differ in the last bit.
SAME = 1e-12
# The same of fixed steps of 10 ms, extrapolated in one interface.
SAME_BY_EITHER_INTERFACE = 1e-3


@dataclass(frozen=True)
class Emulator:
    """A program that runs those of a platform, the Debian packages that have it, and what it finds them by."""

    platform: str
    program: str
    packages: str
    link_flags: Sequence[str]
    root: str
    environment: Callable[[Path], dict[str, str]]
    library: Path | None = None

    @property
    def is_installed(self) -> bool:
        return shutil.which(self.program) is not None and (self.library is None or self.library.exists())


ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")
EMULATORS = (
    Emulator(
        "win64",
        "wine",
        "wine wine64",
        (),
        "Z:",
        lambda folder: {"PATH": os.defpath, "WINEPREFIX": str(folder), "WINEDEBUG": "-all"},
    ),
    Emulator(
        "aarch64-linux",
        "qemu-aarch64",
        "qemu-user libc6-arm64-cross",
        ("-pthread", "-ldl"),
        "",
        lambda folder: {"QEMU_LD_PREFIX": str(ARM_LIBRARIES)},
        ARM_LIBRARIES / "lib" / "libc.so.6",
    ),
)


@dataclass(frozen=True)
class Both:
    """The C host here and emulated, each as what it shows of a plan."""

    emulator: Emulator
    here: Host
    there: Host
    environment: dict[str, str]

    @property
    def platforms(self) -> list[str]:
        return ["linux64", self.emulator.platform]


@pytest.fixture(scope="module", params=EMULATORS, ids=lambda emulator: emulator.platform)
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Both:
    emulator: Emulator = request.param
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip(f"libraries for {emulator.platform} are not run: ziglang, which compiles them, is not installed")
    if not emulator.is_installed:
        pytest.skip(
            f"libraries for {emulator.platform} are not run: {emulator.program} is not installed "
            f"(Debian: apt-get install {emulator.packages})"
        )
    folder = tmp_path_factory.mktemp(emulator.platform)
    environment = emulator.environment(folder / "prefix")
    if emulator.program == "wine":
        # The first call tells on stderr that it makes its folder.
        subprocess.run(["wine", "cmd", "/c", "exit"], env=environment, capture_output=True, timeout=300, check=True)
    toolchain = find_toolchain()
    hosts = []
    for name, flags, programs in (
        ("linux64", ("-pthread", "-ldl"), ()),
        (emulator.platform, emulator.link_flags, (emulator.program,)),
    ):
        (folder / name).mkdir()
        hosts.append(compile_host(toolchain.command_for(PLATFORMS[name]), folder / name, flags, programs))
    return Both(emulator, *hosts, environment)


def same_end(both: Both, text: Callable[..., str]) -> list[float]:
    """What is shown here, held against what is there."""
    here = numbers(both.here(text("linux64")))
    there = numbers(both.there(text(both.emulator.platform, root=both.emulator.root), **both.environment))
    assert len(here) == 3 and there == pytest.approx(here, abs=SAME)
    return here


@pytest.mark.validate
def test_a_c_program_runs_the_robot_as_here_by_either_interface(both: Both, tmp_path: Path) -> None:
    robot = with_effects(paper_robot(), *SEVERAL)
    plan = robot_plan(extracted(build_fmus(robot, tmp_path, native=True, platforms=both.platforms), tmp_path / "fmus"))
    by_co_simulation, by_model_exchange = (
        same_end(both, partial(plan.text, by_model_exchange=each)) for each in (False, True)
    )
    assert by_model_exchange == pytest.approx(by_co_simulation, abs=SAME_BY_EITHER_INTERFACE)


@pytest.mark.validate
def test_a_c_program_runs_the_whole_robot_as_here(both: Both, tmp_path: Path) -> None:
    robot = with_winch(with_effects(paper_robot(), *SEVERAL), LIMITED)
    fmu = build_whole_fmu(robot, tmp_path, platforms=both.platforms)
    (folder,) = unpacked([fmu], tmp_path / "fmus")
    same_end(both, whole_robot_plan(folder, robot.cable_numbers, "speed_command").text)


@pytest.mark.validate
def test_what_is_refused_is_told_in_the_same_words(both: Both, tmp_path: Path) -> None:
    fmus = build_fmus(paper_robot(), tmp_path, native=True, platforms=both.platforms)
    plan = robot_plan(extracted(fmus, tmp_path / "fmus"), steps=1)
    plan.held.append((0, "modulus", -1.5))
    here = both.here(plan.text("linux64"))
    there = both.there(plan.text(both.emulator.platform, root=both.emulator.root), **both.environment)
    assert here.returncode == there.returncode == 1
    assert "modulus is -1.5, it has to be finite, at least" in here.stderr and there.stderr == here.stderr
