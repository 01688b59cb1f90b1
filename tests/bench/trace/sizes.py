"""How strong each hidden effect is, by how well it shows: ``python -m tests.bench.trace.sizes [CASE...]`` finds it.

The rig alone tells it, by what an effect changes in the outputs of the FIT program without noise. What may hide it are
noise of sensors and winch speeds, a constant of each output (but not of a sensor's offset), and another modulus or
damping of all cables.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from math import inf, log, sqrt
from pathlib import Path

import numpy as np

from tests.rig import make_recording

from .cases import Case, Part, Size, main_cases, quick_cases
from .forms import Form, Settings
from .motion import declared, smooth_program
from .visible import Hiding, drift_columns, hiding

FILE = Path(__file__).with_name("sizes.json")
NATS: Mapping[Size, float] = {"small": 1e2, "middle": 1e4, "large": 1e6}
CLOSE = 1.15
TRIES = 12
LARGEST_STEP = 30.0
EXPONENTS = (0.5, 12.0)
NUISANCES = {"modulus": 1e-4, "damping": 1e-2}
# Forms that are a constant themselves: beside them no other one is free.
CONSTANT = "sensor_offset"


@dataclass(frozen=True)
class Sized:
    """A strength and the visibility that it has, in nats."""

    strength: float
    nats: float


class Stage:
    """One case's FIT program, on which effects are compared without noise."""

    def __init__(self, case: Case) -> None:
        self.robot = declared(case.robot)
        self.motion = case.motion
        self.program = smooth_program(case.robot, self.motion, case.seed("fit"))
        noise = self.robot.noise
        self.sigma = np.concatenate([np.full(self.robot.count, noise.tension), np.full(3, noise.position)])
        self.plain = self._outputs({})
        self._hiding: dict[tuple[str, ...], Hiding] = {}

    def nats(self, form: Form, strength: float) -> float:
        """Visibility of a form; 0 where the rig cannot run it."""
        try:
            change = self._outputs({form.name: form.settings(strength, self.robot)}) - self.plain
        except (ValueError, RuntimeError):
            return 0.0
        names = tuple(name for name in (*NUISANCES, CONSTANT) if name != form.name)
        return self._hidden_by(names).nats(change / self.sigma)

    def _outputs(self, effects: dict[str, Settings]) -> np.ndarray:
        """Tensions and positions, (samples, cables + 3)."""
        frame = make_recording(
            self.robot,
            effects,
            self.program,
            duration=self.motion.duration,
            rate=self.motion.rate,
            seed=0,
            noise=False,
        )
        return frame.to_numpy()[:, 1 + self.robot.count :]

    def _hidden_by(self, names: tuple[str, ...]) -> Hiding:
        if names not in self._hiding:
            drift = drift_columns(
                self.robot,
                1.0 / self.motion.rate,
                self.plain[:, self.robot.count :],
                self.plain[:, : self.robot.count],
            )
            free = [self._slopes[name] for name in names if name != CONSTANT]
            self._hiding[names] = hiding(drift / self.sigma[:, None], free, CONSTANT in names)
        return self._hiding[names]

    @cached_property
    def _slopes(self) -> dict[str, np.ndarray]:
        """What a little more of each nuisance changes, in standard deviations of the sensors."""
        results = {}
        for name, share in NUISANCES.items():
            value = float(getattr(self.robot, name)[0]) * (1.0 + share)
            results[name] = (self._outputs({name: {name: value}}) - self.plain) / self.sigma
        return results


def sized(stage: Stage, part: Part) -> Sized:
    """The strength at which a part of a case is as visible as its size asks for, or the most it may have.

    Newton's steps between logarithms, kept between what shows less and what shows more or cannot run: visibility
    grows with the square of the strength where the change is linear.
    """
    form, target = part.form, NATS[part.size]
    found, exponent = Sized(form.start, stage.nats(form, form.start)), 2.0
    low, high = 0.0, inf
    for _ in range(TRIES):
        if form.start == form.most or 1.0 / CLOSE < found.nats / target < CLOSE:
            break
        if 0.0 < found.nats < target:
            low = max(low, found.strength)
        else:
            high = min(high, found.strength)
        factor = (target / found.nats) ** (1.0 / exponent) if found.nats > 0.0 else 0.3
        strength = min(found.strength * float(np.clip(factor, 1.0 / LARGEST_STEP, LARGEST_STEP)), form.most)
        if not low < strength < high:
            strength = sqrt(low * high) if 0.0 < low < high < inf else strength
        if strength == found.strength:
            break
        last, found = found, Sized(strength, stage.nats(form, strength))
        if min(last.nats, found.nats) > 0.0:
            slope = log(found.nats / last.nats) / log(found.strength / last.strength)
            exponent = float(np.clip(slope, *EXPONENTS))
    return Sized(float(f"{found.strength:.4g}"), float(f"{found.nats:.3g}"))


def sizes_of(case: Case) -> dict[str, Sized]:
    """The size of each part of a case, by its form."""
    stage = Stage(case)
    return {part.form.key: sized(stage, part) for part in case.parts}


@cache
def stored() -> Mapping[str, Mapping[str, Sized]]:
    """What sizes.json says, by case and form."""
    content = json.loads(FILE.read_text(encoding="utf-8"))
    return {case: {form: Sized(*values) for form, values in parts.items()} for case, parts in content.items()}


def strengths(case: Case) -> dict[str, float]:
    """The stored strengths of a case; none where it hides nothing."""
    result = stored().get(case.key, {})
    missing = [part.form.key for part in case.parts if part.form.key not in result]
    if missing:
        raise KeyError(f"{case.key}: no size of {missing[0]} in {FILE}; run python -m tests.bench.trace.sizes")
    return {part.form.key: result[part.form.key].strength for part in case.parts}


def main() -> None:
    """Size the cases that are named, or all, and write the file as they come."""
    cases = {case.key: case for case in (*quick_cases(), *main_cases()) if case.parts}
    content = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for key in sys.argv[1:] or cases:
        content[key] = {form: [size.strength, size.nats] for form, size in sizes_of(cases[key]).items()}
        print(key, content[key], flush=True)
        rows = [f"  {json.dumps(case)}: {json.dumps(content[case])}" for case in cases if case in content]
        FILE.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
