"""What all pages share: typeset numbers, and colours that stand out from their ground in the light and in the dark."""

from __future__ import annotations

import re

import pytest

from tautwire.reports.page_rendering import asset, typeset_number, typeset_prose

TEXT, GRAPHIC = 4.5, 3.0  # WCAG 2.2, 1.4.3 and 1.4.11
TEXTS = ("text", "muted", "accent", "good", "warn", "mode")
GRAPHICS = ("accent", "before", "measured", "mode", "low", "middle", "high")


def themes() -> dict[str, dict[str, str]]:
    """The custom properties of the light theme, and of the dark one over them."""
    blocks = re.findall(r":root \{(.*?)\}", asset("style.css"), re.DOTALL)
    light, dark = (dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6});", block)) for block in blocks)
    return {"light": light, "dark": light | dark}


def luminance(colour: str) -> float:
    """Relative luminance by WCAG 2.2."""
    channels = [int(colour[place : place + 2], 16) / 255.0 for place in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """Contrast ratio by WCAG 2.2, from 1 to 21."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("ground", ["page", "surface"])
@pytest.mark.parametrize(("names", "least"), [(TEXTS, TEXT), (GRAPHICS, GRAPHIC)])
def test_colours_stand_out(theme: str, ground: str, names: tuple[str, ...], least: float) -> None:
    colours = themes()[theme]
    weak = {name: contrast(colours[name], colours[ground]) for name in names}
    assert {name: ratio for name, ratio in weak.items() if ratio < least} == {}


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_chosen_and_pressed_controls_stand_out(theme: str) -> None:
    colours = themes()[theme]
    assert contrast(colours["accent"], colours["accent-soft"]) >= TEXT
    assert contrast(colours["page"], colours["accent"]) >= TEXT


def test_before_and_after_differ_for_those_who_see_no_hue() -> None:
    for colours in themes().values():
        assert contrast(colours["before"], colours["accent"]) >= 1.3


def test_powers_and_absent_numbers_are_typeset() -> None:
    assert typeset_prose("12 mm^2 & N m^-1") == "12 mm² &amp; N m⁻¹"
    assert typeset_number("-1.5e-08 m") == "\u22121.5\u00a0\u00d7\u00a010⁻⁸ m"
    assert typeset_number("- to 2e+03 %") == "\u2013 to 2\u00a0\u00d7\u00a010³\u00a0%"
