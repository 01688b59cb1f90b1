"""Draws the icons of the FMUs, ``model.png`` in each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PIL import Image, ImageDraw

# FMI 3.0 recommends 100 pixels; drawn on a canvas of 96 units, enlarged so that lines become smooth.
PIXELS, SIZE, SCALE = 100, 96, 8
INK, FILL, PAPER = (28, 52, 96), (160, 190, 235), (255, 255, 255)
LINE = 3 * SCALE


def draw_icons(folder: Path) -> None:
    """Write one PNG of 100 pixels for each kind of component."""
    for name, draw in ICONS.items():
        image = Image.new("RGB", (SIZE * SCALE, SIZE * SCALE), PAPER)
        draw(ImageDraw.Draw(image))
        small = image.resize((PIXELS, PIXELS), Image.Resampling.LANCZOS).quantize(16)
        small.save(folder / f"{name}.png", optimize=True)


def _points(*numbers: float) -> list[float]:
    return [SCALE * number for number in numbers]


def _cable(canvas: ImageDraw.ImageDraw) -> None:
    canvas.line(_points(18, 20, 78, 76), fill=INK, width=LINE)
    canvas.ellipse(_points(10, 12, 26, 28), fill=FILL, outline=INK, width=LINE)
    canvas.rectangle(_points(68, 68, 88, 84), fill=FILL, outline=INK, width=LINE)


def _platform(canvas: ImageDraw.ImageDraw) -> None:
    for corner in (8, 88):
        canvas.line(_points(corner, 10, 48, 58), fill=INK, width=LINE)
    canvas.line(_points(48, 8, 48, 58), fill=INK, width=LINE)
    canvas.rectangle(_points(26, 54, 70, 84), fill=FILL, outline=INK, width=LINE)


def _rigid_platform(canvas: ImageDraw.ImageDraw) -> None:
    for corner, end in (((8, 10), (22, 56)), ((88, 10), (74, 48))):
        canvas.line(_points(*corner, *end), fill=INK, width=LINE)
    outline = _points(22, 56, 74, 48, 78, 78, 26, 86, 22, 56)
    canvas.polygon(outline, fill=FILL)
    canvas.line(outline, fill=INK, width=LINE, joint="curve")


def _winch(canvas: ImageDraw.ImageDraw) -> None:
    canvas.line(_points(46, 16, 90, 16), fill=INK, width=LINE)
    canvas.ellipse(_points(14, 15, 78, 79), fill=FILL, outline=INK, width=LINE)
    canvas.ellipse(_points(38, 39, 54, 55), fill=PAPER, outline=INK, width=LINE)
    canvas.line(_points(8, 86, 84, 86), fill=INK, width=LINE)


def _controller(canvas: ImageDraw.ImageDraw) -> None:
    canvas.rectangle(_points(12, 20, 84, 76), fill=FILL, outline=INK, width=LINE)
    canvas.line(_points(22, 62, 36, 62, 36, 46, 50, 46, 50, 34, 74, 34), fill=INK, width=LINE)


def _robot(canvas: ImageDraw.ImageDraw) -> None:
    canvas.rectangle(_points(8, 8, 88, 88), outline=INK, width=LINE)
    for corner in ((10, 10), (86, 10), (10, 86), (86, 86)):
        canvas.line(_points(*corner, 48, 50), fill=INK, width=LINE)
    canvas.rectangle(_points(32, 36, 64, 64), fill=FILL, outline=INK, width=LINE)


ICONS: dict[str, Callable[[ImageDraw.ImageDraw], None]] = {
    "cable": _cable,
    "point_mass": _platform,
    "rigid_body": _rigid_platform,
    "winch": _winch,
    "controller": _controller,
    "robot": _robot,
}
