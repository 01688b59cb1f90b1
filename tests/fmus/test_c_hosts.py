"""FMUs for C hosts: run by a plain C program (``c_host/host.c``), as in Python and as the one model in memory."""

from __future__ import annotations

import shutil
import sysconfig
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from tautwire.fmus import c_hosts
from tautwire.fmus.c_hosts import CHostError, EmbeddablePython, make_for_c_hosts
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.reference_simulation import integrate
from tests.support.c_programs import RAMPS, STEP, STEPS, Host, Plan, compile_host, extracted, numbers, robot_plan
from tests.support.robots import paper_robot


def cable_plan(folders: list[Path]) -> Plan:
    """Cables on their own, winches ramping before a platform at rest."""
    plan = Plan(folders, steps=20)
    plan.ramps = [(cable, "winch_speed", 0.3) for cable in range(len(folders))]
    plan.held = [(cable, "winch_acceleration", 0.3) for cable in range(len(folders))]
    plan.shown = [(cable, "tension") for cable in range(len(folders))]
    return plan


def for_c_hosts(fmus: RobotFmus, into: Path) -> RobotFmus:
    """Copies that are made for C hosts."""
    into.mkdir(parents=True, exist_ok=True)
    copies = [Path(shutil.copy(fmu, into)) for fmu in (*fmus.cables, fmus.platform)]
    for fmu in copies:
        make_for_c_hosts(fmu)
    return RobotFmus(tuple(copies[:-1]), copies[-1])


@pytest.fixture(scope="module")
def ready() -> tuple[str, ...]:
    """The C compiler, where FMUs for C hosts can be made at all."""
    try:
        c_hosts.embeddable_python()
        return c_hosts.find_compiler()
    except CHostError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def host(ready: tuple[str, ...], tmp_path_factory: pytest.TempPathFactory) -> Host:
    """Runs a plan in the C host."""
    return compile_host(ready, tmp_path_factory.mktemp("host"))


@pytest.fixture(scope="module")
def fmus(ready: tuple[str, ...], three_fmus: RobotFmus, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's robot, for C hosts."""
    return for_c_hosts(three_fmus, tmp_path_factory.mktemp("for c hosts"))


@pytest.fixture(scope="module")
def folders(fmus: RobotFmus, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return extracted(fmus, tmp_path_factory.mktemp("extracted"))


@pytest.mark.validate
def test_the_robot_in_a_c_program_is_that_in_python_and_near_the_one_model(host: Host, folders: list[Path]) -> None:
    plan = robot_plan(folders)
    shown = numbers(host(plan.text()))
    assert shown == pytest.approx(plan.in_python(), abs=1e-12)
    until = STEPS * STEP
    run = integrate(paper_robot(), np.array([0.0, until]), np.array([[0.0] * 3, [rate * until for rate in RAMPS]]))
    assert np.linalg.norm(np.array(shown) - run.position[-1]) < 0.5e-3


def test_a_winch_in_a_c_program_is_that_in_python(
    ready: tuple[str, ...], host: Host, winch_fmus: RobotFmus, tmp_path: Path
) -> None:
    fmu = Path(shutil.copy(winch_fmus.by_component["winch_1"], tmp_path))
    make_for_c_hosts(fmu)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path / "winch")
    plan = Plan([tmp_path / "winch"])
    plan.ramps, plan.held = [(0, "speed_command", 0.4)], [(0, "speed_command_rate", 0.4)]
    plan.shown = [(0, "winch_speed"), (0, "winch_acceleration"), (0, "motor_speed")]
    shown = numbers(host(plan.text()))
    assert shown == pytest.approx(plan.in_python(), abs=1e-13)
    assert shown[0] == pytest.approx(0.9, abs=1e-6)


def test_without_the_option_a_c_program_cannot_load_the_fmus(host: Host, three_fmus: RobotFmus, tmp_path: Path) -> None:
    done = host(robot_plan(extracted(three_fmus, tmp_path)).text())
    assert done.returncode == 1
    assert "undefined symbol: _Py_NoneStruct" in done.stderr


def test_the_importers_environment_has_no_say(host: Host, folders: list[Path], tmp_path: Path) -> None:
    for name in ("json", "encodings", "pythonfmu", "sitecustomize"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('not mine')\n")
    plan = cable_plan(folders[:1])
    shown = numbers(host(plan.text()))
    assert numbers(host(plan.text(), PYTHONPATH=str(tmp_path), PYTHONHOME=str(tmp_path), PATH=str(tmp_path))) == shown
    assert numbers(host(plan.text(), LC_ALL="C", PYTHONUTF8="0", PYTHONSTARTUP=str(tmp_path / "json.py"))) == shown


def test_python_finds_nothing_but_its_standard_library_and_the_fmu(
    monkeypatch: pytest.MonkeyPatch, host: Host, three_fmus: RobotFmus, tmp_path: Path
) -> None:
    python = c_hosts.embeddable_python()
    home = tmp_path / "ho me+é"
    home.symlink_to(python.home.split(":")[0])
    elsewhere = replace(python, home=str(home))
    monkeypatch.setattr(c_hosts, "embeddable_python", lambda: elsewhere)
    folder = extracted(for_c_hosts(three_fmus, tmp_path / "fmus"), tmp_path)[0]
    resources = folder / "resources"
    script = resources / ((resources / "slavemodule.txt").read_text().strip() + ".py")
    seen = "[*sys.path, 'site' in sys.modules, sys.flags.isolated]"
    script.write_text(script.read_text() + f"import sys\nprint(*{seen}, sep='\\n', file=sys.stderr)\n")
    output_lines = host(cable_plan([folder]).text()).stderr.splitlines()
    # pythonfmu runs the script twice at every instantiation.
    first, *library, site, isolated = output_lines[: len(output_lines) // 2]
    assert (first, site, isolated) == (str(resources), "False", "1")
    assert len(library) == 3 and all(Path(path).is_relative_to(home) for path in library)
    assert not list(folder.rglob("__pycache__"))


def test_a_missing_python_is_an_error_in_a_c_program_but_not_in_a_python_process(
    monkeypatch: pytest.MonkeyPatch, host: Host, three_fmus: RobotFmus, tmp_path: Path
) -> None:
    headers = c_hosts.embeddable_python().headers
    gone = EmbeddablePython(Path("/gone/libpython9.9.so.1.0"), "/gone", Path("/gone/lib/python9.9"), headers)
    monkeypatch.setattr(c_hosts, "embeddable_python", lambda: gone)
    folder = extracted(for_c_hosts(three_fmus, tmp_path / "fmus"), tmp_path)[0]
    done = host(cable_plan([folder, folder]).text())
    assert done.returncode == 1
    assert "this FMU needs Python: /gone/libpython9.9.so.1.0" in done.stderr
    assert cable_plan([folder]).in_python()[0] > 0.0


@pytest.mark.validate
def test_fmus_of_two_robots_in_one_c_process_run_their_own_physics(
    host: Host, folders: list[Path], tmp_path: Path
) -> None:
    soft = for_c_hosts(build_fmus(paper_robot(modulus=40e9), tmp_path / "plain"), tmp_path / "soft")
    others = extracted(soft, tmp_path / "extracted")
    plan = cable_plan([folders[0], others[0], folders[0]])
    both = numbers(host(plan.text()))
    assert both[0] == both[2] > both[1] + 50.0
    assert both == plan.in_python()


@pytest.mark.parametrize("name", ["a b", "a+b", "é", "a#b", "100%", "%41 %d", "a?b&c;d", "'\"$(e)"])
def test_any_folder_name_will_do(host: Host, fmus: RobotFmus, tmp_path: Path, name: str) -> None:
    plan = cable_plan(extracted(fmus, tmp_path / name)[:1])
    assert numbers(host(plan.text())) == plan.in_python()


def test_a_folder_that_pythonfmu_would_take_for_another_is_refused(host: Host, fmus: RobotFmus, tmp_path: Path) -> None:
    plan = cable_plan(extracted(fmus, tmp_path / "a%20b")[:1])
    extracted(fmus, tmp_path / "a b")
    assert "pythonfmu cannot read from a folder with %20 in its name" in host(plan.text()).stderr
    with pytest.raises(Exception, match="Failed to instantiate"):
        plan.in_python()


@pytest.mark.parametrize("uri", ["", "file:/{}", "file://localhost/{}", "/{}", "file:///nowhere", "%"])
def test_resources_are_found_whatever_the_importer_calls_them(host: Host, folders: list[Path], uri: str) -> None:
    plan = cable_plan(folders[:1])
    right = (folders[0] / "resources").as_uri()
    given = uri.format(right.removeprefix("file:///"))
    assert numbers(host(plan.text().replace(right, given))) == numbers(host(plan.text()))


def test_missing_resources_are_an_error_and_no_crash(host: Host, fmus: RobotFmus, tmp_path: Path) -> None:
    folder = extracted(fmus, tmp_path)[0]
    text = cable_plan([folder]).text()
    shutil.rmtree(folder / "resources")
    done = host(text)
    assert done.returncode == 1
    assert f"no resources of this FMU in {folder / 'resources'}" in done.stderr


def test_a_python_that_the_importer_keeps_to_itself_is_shared(host: Host, folders: list[Path]) -> None:
    plan = cable_plan(folders[:2])
    library = c_hosts.embeddable_python().library
    assert numbers(host(f"python {library}\n" + plan.text())) == numbers(host(plan.text()))


def test_the_fmus_stay_valid_and_keep_their_other_members(fmus: RobotFmus, three_fmus: RobotFmus) -> None:
    for plain, made in zip((*three_fmus.cables, three_fmus.platform), (*fmus.cables, fmus.platform), strict=True):
        assert validate_fmu(str(made)) == []
        own = f"binaries/linux64/{made.stem}.so"
        before, after = contents(plain), contents(made)
        assert after.pop(own) != before[own]
        assert after.pop(f"binaries/linux64/{made.stem}.pythonfmu.so") == before.pop(own)
        assert after == before


def contents(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def test_made_twice_they_are_the_same(fmus: RobotFmus, tmp_path: Path) -> None:
    again = Path(shutil.copy(fmus.platform, tmp_path))
    make_for_c_hosts(again)
    assert again.read_bytes() == fmus.platform.read_bytes()
    assert list(tmp_path.iterdir()) == [again]


@pytest.fixture
def platform(ready: tuple[str, ...], three_fmus: RobotFmus, tmp_path: Path) -> Iterator[Path]:
    """A plain FMU that must come through a refusal as it is."""
    fmu = Path(shutil.copy(three_fmus.platform, tmp_path))
    before = fmu.read_bytes()
    yield fmu
    assert fmu.read_bytes() == before
    assert list(tmp_path.iterdir()) == [fmu]


def test_a_missing_compiler_is_named_with_a_hint(monkeypatch: pytest.MonkeyPatch, platform: Path) -> None:
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(CHostError, match=r"no no-such-compiler -m64 \(from CC\); install a C compiler") as caught:
        make_for_c_hosts(platform)
    assert "apt install gcc" in caught.value.hint


def test_a_compiler_that_fails_is_quoted(monkeypatch: pytest.MonkeyPatch, platform: Path) -> None:
    monkeypatch.setenv("CC", shutil.which("false") or "false")
    with pytest.raises(CHostError, match="cannot compile the C part of the FMUs: exit status 1"):
        make_for_c_hosts(platform)


def test_a_python_without_libpython_is_refused_with_a_hint(
    monkeypatch: pytest.MonkeyPatch, platform: Path, tmp_path: Path
) -> None:
    settings = {"INSTSONAME": "libpython3.x.a", "Py_ENABLE_SHARED": 0, "LIBDIR": "/gone", "LDVERSION": "9.9"}
    monkeypatch.setattr(sysconfig, "get_config_var", settings.get)
    with pytest.raises(CHostError, match=r"built without a shared libpython.*--enable-shared"):
        make_for_c_hosts(platform)


def test_what_is_not_an_fmu_of_pythonfmu_is_refused(ready: tuple[str, ...], tmp_path: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("no archive")
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("binaries/linux64/other.so", b"")
    for fmu in (text, other):
        with pytest.raises(CHostError, match="is not an FMU that pythonfmu built"):
            make_for_c_hosts(fmu)
