"""Which component is in question, by which residuals at the measured ports are more than noise."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from .port_residuals import PLATFORM, ComponentResidual

CANNOT_TELL = "cannot tell"
NOTHING = "nothing"


def blame(
    cables_off: Mapping[int, bool],
    platform_off: bool | None,
    closes: bool = False,
    exits: Collection[int] = (),
) -> str:
    """The component in question.

    ``cables_off`` tells by number whether the tension of a cable's FMU is off, without those that could not be looked
    at; ``platform_off`` whether the platform's balance is, None where it could not be. ``closes`` tells that the
    balance closes with the tensions that the FMUs of those cables show; ``exits`` are cables whose residual a shifted
    exit point would explain without showing in the balance.

    ==================== ================ ====================================================
    tensions that are off platform's force component
    ==================== ================ ====================================================
    none                 within noise     nothing
    none                 off              platform
    of cable i           within noise     cable i (rope or winch): its measured tension is real
    of cable i           off, and closes  load cell i, or friction between it and the platform
    of cable i           off              load cell i or exit point i, or several components
    of cable i           not known        cable i (rope, winch, load cell or exit point)
    none                 not known        nothing in these cables, cannot tell more
    not known            not known        cannot tell
    ==================== ================ ====================================================

    Where all of several cables are off the position sensor comes in question as well.
    """
    wrong = [number for number, is_off in cables_off.items() if is_off]
    sensor = ["the position sensor"] if len(wrong) == len(cables_off) > 1 else []
    if platform_off is None:
        return _without_balance(cables_off, wrong)
    if not wrong:
        return PLATFORM if platform_off else NOTHING
    if not platform_off:
        inside = "rope, winch or exit point" if set(wrong) <= set(exits) else "rope or winch"
        return either([f"{named('cable', wrong)} ({inside})", *sensor])
    if closes:
        return either([named("load cell", wrong), "friction before it" if len(wrong) == 1 else "friction before them"])
    return either([named("load cell", wrong), named("exit point", wrong), *sensor, "several components"])


def verdict_of(
    cables: Sequence[ComponentResidual],
    platform: Sequence[ComponentResidual],
    closes: bool = False,
    exits: Collection[int] = (),
) -> tuple[str, str]:
    """The component in question, and the sentence that says why; ``platform`` is empty where it was not looked at."""
    off = {int(part.component.split()[1]): part.is_off for part in cables}
    to_blame = blame(off, any(part.is_off for part in platform) if platform else None, closes, exits)
    facts = [*_of_cables(cables), *_of_platform(platform)]
    ringing = [part for part in platform if part.is_off and part.rings_at is not None]
    if to_blame == PLATFORM and ringing:
        frequency = max(ringing, key=lambda part: part.ratio).rings_at
        facts.append(f"it rings at {frequency:.2f} Hz, as something that swings or shakes by itself does")
    told = "; ".join(facts)
    where = {PLATFORM: "it is at the platform", NOTHING: "nothing is off"}.get(to_blame, f"in question: {to_blame}")
    return to_blame, f"{told[:1].upper()}{told[1:]}. {where[:1].upper()}{where[1:]}." if told else _alone(to_blame)


def _alone(to_blame: str) -> str:
    return f"{to_blame[:1].upper()}{to_blame[1:]} which component is off."


def _of_cables(cables: Sequence[ComponentResidual]) -> list[str]:
    wrong = [part for part in cables if part.is_off]
    if not wrong:
        whose = "the cables' tensions are" if len(cables) > 1 else "the cable's tension is"
        return [f"{whose} within noise"] if cables else []
    if len(wrong) == 1:
        return [f"{wrong[0].component}'s tension is {_off(wrong[0])}"]
    worst = max(wrong, key=lambda part: part.ratio)
    numbers = named("cable", [int(part.component.split()[1]) for part in wrong])
    return [f"the tensions of {numbers} are off, that of {worst.component} most: {_off(worst)}"]


def _of_platform(platform: Sequence[ComponentResidual]) -> list[str]:
    if not platform:
        return []
    worst = max(platform, key=lambda part: part.ratio)
    if not worst.is_off:
        return ["the platform's force balance is within its noise"]
    return [f"the platform's {worst.quantity} is {_off(worst)}"]


def _off(part: ComponentResidual) -> str:
    return f"off by {_figure(part.rms)} {part.unit} rms (expected {_figure(part.expected_rms)} {part.unit})"


def _figure(value: float) -> str:
    """Two significant digits, without an exponent."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _without_balance(cables_off: Mapping[int, bool], wrong: Sequence[int]) -> str:
    if wrong:
        return f"{named('cable', wrong)} (rope, winch, load cell or exit point)"
    if cables_off:
        return f"nothing in {named('cable', list(cables_off))}; {CANNOT_TELL} more"
    return CANNOT_TELL


def named(what: str, numbers: Sequence[int]) -> str:
    """As in "cable 2" and "cables 1, 3"."""
    return f"{what}{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"


def either(names: Sequence[str]) -> str:
    """As in "a", "a or b" and "a; b or c" where names have commas of their own."""
    *before, last = names
    return f"{'; '.join(before)} or {last}" if before else last
