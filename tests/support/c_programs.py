"""A robot's exchange in a plain C program, ``c_host/host.c``, and the same in Python."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import ModelDescription

from tautwire.fmus.native.c_toolchain import PLATFORMS
from tautwire.fmus.packaging import RobotFmus
from tests.support.folders import SUPPORT

Host = Callable[..., "subprocess.CompletedProcess[str]"]
RAMPS = (0.3, 0.25, -0.25)
STEP = 0.01
STEPS = 300
AXES = "xyz"


@dataclass
class Plan:
    """A robot's exchange, for the C host and for Python alike: entries refer to FMUs by number, to variables by name.

    ``connections`` are (source, output, target, input), ``ramps`` and ``held`` (target, input, value), ``shown``
    (source, output).
    """

    folders: list[Path]
    steps: int = STEPS
    connections: list[tuple[int, str, int, str]] = field(default_factory=list)
    ramps: list[tuple[int, str, float]] = field(default_factory=list)
    held: list[tuple[int, str, float]] = field(default_factory=list)
    shown: list[tuple[int, str]] = field(default_factory=list)

    def text(self, platform: str = "linux64", by_model_exchange: bool = False, root: str = "") -> str:
        """As ``host.c`` reads it, with the libraries of a platform; ``root`` is in front of their paths."""
        descriptions = [_description(folder) for folder in self.folders]
        references = [{v.name: v.valueReference for v in d.modelVariables} for d in descriptions]
        lines = ["exchange yes"] if by_model_exchange else []
        for folder, description in zip(self.folders, descriptions, strict=True):
            lines.append(f"fmu {root}{_library(folder, description, platform)}")
            lines.append(f"states {len(description.derivatives)}")
            lines.append(f"guid {description.guid}")
            lines.append(f"resources {(folder / 'resources').as_uri()}")
        for a, output, b, name in self.connections:
            lines.append(f"connect {a} {references[a][output]} {b} {references[b][name]}")
        for order, entries in (("ramp", self.ramps), ("hold", self.held)):
            lines += [f"{order} {a} {references[a][name]} {value!r}" for a, name, value in entries]
        lines += [f"step {STEP!r}", f"steps {self.steps}"]
        lines += [f"show {a} {references[a][output]}" for a, output in self.shown]
        return "".join(line + "\n" for line in lines)

    def in_python(self) -> list[float]:
        """The same exchange through fmpy: what is shown, at the end."""
        hands = [_Hand(folder) for folder in self.folders]
        for a, name, value in self.held:
            hands[a].set(name, value)
        for hand in hands:
            hand.fmu.exitInitializationMode()
        for index in range(self.steps):
            values = [hands[a].get(output) for a, output, _, _ in self.connections]
            for (_, _, b, name), value in zip(self.connections, values, strict=True):
                hands[b].set(name, value)
            for a, name, rate in self.ramps:
                hands[a].set(name, rate * (index * STEP))
            for hand in hands:
                hand.fmu.doStep(currentCommunicationPoint=index * STEP, communicationStepSize=STEP)
        shown = [hands[a].get(output) for a, output in self.shown]
        for hand in hands:
            hand.fmu.terminate()
            hand.fmu.freeInstance()
        return shown


class _Hand:
    def __init__(self, folder: Path) -> None:
        description = _description(folder)
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        identifier = description.coSimulation.modelIdentifier
        self.fmu = FMU2Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=identifier)
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()

    def get(self, name: str) -> float:
        (value,) = self.fmu.getReal([self.references[name]])
        return float(value)

    def set(self, name: str, value: float) -> None:
        self.fmu.setReal([self.references[name]], [value])


def _description(folder: Path) -> ModelDescription:
    return fmpy.read_model_description(str(folder))


def _library(folder: Path, description: ModelDescription, platform: str) -> Path:
    name = description.coSimulation.modelIdentifier
    return folder / "binaries" / platform / f"{name}{PLATFORMS[platform].suffix}"


def robot_plan(folders: list[Path], steps: int = STEPS) -> Plan:
    """The whole robot, winches ramping; the platform's folder is the last."""
    plan = Plan(folders, steps)
    platform = len(folders) - 1
    plan.shown = [(platform, f"position.{axis}") for axis in AXES]
    for cable in range(platform):
        for axis in AXES:
            for name in ("position", "velocity", "acceleration"):
                plan.connections.append((platform, f"{name}.{axis}", cable, f"{name}.{axis}"))
            for name in ("force", "force_rate"):
                plan.connections.append((cable, f"{name}.{axis}", platform, f"{name}_{cable + 1}.{axis}"))
        plan.ramps.append((cable, "winch_speed", RAMPS[cable]))
        plan.held.append((cable, "winch_acceleration", RAMPS[cable]))
    return plan


def whole_robot_plan(folder: Path, cables: Sequence[int], command: str = "winch_speed") -> Plan:
    """The whole robot as one FMU, the commands of its winches ramping."""
    rate = {"winch_speed": "winch_acceleration"}.get(command, f"{command}_rate")
    plan = Plan([folder], shown=[(0, f"position.{axis}") for axis in AXES])
    plan.ramps = [(0, f"{command}_{number}", value) for number, value in zip(cables, RAMPS, strict=True)]
    plan.held = [(0, f"{rate}_{number}", value) for number, value in zip(cables, RAMPS, strict=True)]
    return plan


def extracted(fmus: RobotFmus, into: Path) -> list[Path]:
    """The folders of a robot's FMUs, the platform's last."""
    return unpacked((*fmus.cables, fmus.platform), into)


def unpacked(paths: Sequence[Path], into: Path) -> list[Path]:
    """The folders of FMUs."""
    folders = []
    for fmu in paths:
        folders.append(into / fmu.stem)
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folders[-1])
    return folders


def compile_host(
    compiler: Sequence[str],
    scratch: Path,
    link_flags: Sequence[str] = ("-pthread", "-ldl"),
    emulator: Sequence[str] = (),
) -> Host:
    """Runs a plan in the C host, behind an ``emulator`` if any, in an environment that has only what is given."""
    program = scratch / "host.exe"
    headers = next(Path(fmpy.__file__).parent.rglob("fmi2Functions.h")).parent
    source = SUPPORT / "c_host" / "host.c"
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{headers}"]
    subprocess.run([*compiler, *flags, str(source), "-o", str(program), *link_flags], check=True)

    def run(plan: str, **environment: str) -> subprocess.CompletedProcess[str]:
        order = scratch / "plan.txt"
        order.write_text(plan, encoding="utf-8")
        return subprocess.run(
            [*emulator, str(program), str(order)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    return run


def numbers(done: subprocess.CompletedProcess[str]) -> list[float]:
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return [float(line) for line in done.stdout.split()]
