"""The template of a new robot file: commented TOML that can be built and run as it is."""

from __future__ import annotations

import json
from math import cos, pi, sin
from textwrap import fill

from tautwire_fmu.laws.effects import ALL

MIN_TEMPLATE_CABLES, MAX_TEMPLATE_CABLES = 2, 12

TEMPLATE_HEAD = """\
# A cable-driven robot. SI units throughout; z points up; cables count from 1 in the order of this file.
# The numbers are an example, of a frame of 8 m: put in yours, then run "tautwire check" on this file.

name = {name}
gravity = 9.81                    # m/s^2

[platform]
mass = 50.0                       # kg, a point mass
start = [0.0, 0.0, 2.0]           # m, where every run starts at rest; on two cables in their plane
# mass_uncertainty = 0.5          # kg, how far the true mass may be from that; a standard deviation, as all of these

# A platform that turns: with an inertia it is a rigid body, start is the origin of its frame, and each cable has an
# attachment in that frame.
# inertia = [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 6.0]]  # kg m^2, about the centre of mass, in its axes
# centre_of_mass = [0.0, 0.0, 0.1]           # m, in the platform's frame; 0 when absent
# start_orientation = [1.0, 0.0, 0.0, 0.0]   # unit quaternion w, x, y, z, platform to world; none when absent
# inertia_uncertainty = 0.1                  # kg m^2, of each principal moment
# centre_of_mass_uncertainty = 5e-3          # m, of each coordinate

# With more than three cables (six, for a platform that turns) statics leaves a choice: within these bounds, the start
# tensions are those nearest to the preferred one. With fewer they are not used.
[tension]
minimum = 50.0                    # N
maximum = 5000.0                  # N
preferred = {preferred}                 # N
# preferred_uncertainty = 50.0    # N, how far true start tensions may be from that

# Standard deviation of the noise of one sample; remove what you do not know. An uncertainty is a standard deviation
# too: about half of a data sheet's +- that is a limit.
[sensors]
position_noise = 2e-4             # m
tension_noise = 1.0               # N
winch_speed_noise = 1e-4          # m/s
# orientation_noise = 1e-3        # rad, about each axis, of a platform that turns
# tension_offset_uncertainty = 2.0    # N, constant error of a load cell
# tension_gain_uncertainty = 0.004    # of a load cell's gain about 1
# position_offset_uncertainty = 1e-3  # m, constant error of the tracker, on each axis

# One table for each cable, two or more. The law of tension is T = E S eps + c S deps/dt + T0.
"""
TEMPLATE_CABLE = """
[[cable]]  # cable {number}
anchor = [{x}, {y}, {z}]  # m, where the cable leaves the frame
# attachment = [0.2, 0.0, 0.0]    # m, in the frame of a platform that turns; its origin when absent
# swivel_axis = [0.0, 0.0, 1.0]   # along which the rope arrives at its exit pulley; vertical when absent
modulus = 1.0e11                  # Pa, E: steel rope about 1e11, braided polyethylene about 6e10
area = 3.0e-6                     # m^2, S, the section that the modulus refers to
damping = 1.0e9                   # Pa s, c: modulus times the time of retardation; 0 when absent
law = "logarithmic"               # eps is ln(l/l_u); or "linear", l/l_u - 1
# modulus_uncertainty = 2e9       # Pa
# damping_uncertainty = 1e8       # Pa s
# anchor_uncertainty = 2e-3       # m, of each coordinate
# attachment_uncertainty = 1e-3   # m, of each coordinate
"""
TEMPLATE_TAIL = """
# Winches that follow a speed command with limited dynamics; without this table the rope runs exactly at that speed.
# [winch]
# drum_radius = 0.1               # m
# gear = 20.0                     # motor turns for one turn of the drum
# bandwidth = 10.0                # Hz, natural frequency of the speed loop
# damping_ratio = 1.0
# speed_limit = 1.0               # m/s, of the rope
# acceleration_limit = 5.0        # m/s^2

# Effects that the plain model lacks; "tautwire trace" identifies them from recordings and writes such tables. All:
{effects}
# [effect.payload]
# mass = 5.0                      # kg

# [effect.modulus]
# modulus = 0.9e11                # Pa, replaces the declared one
# cables = [2]                    # all cables without this line

# A formula for what no known effect explains.
# [formula]
# force_x = "-20*vx"              # N, on the platform

# User FMUs instead of the project's, relative to this file.
# [fmu]
# platform = "mine.fmu"
# native = true                   # the project's own as machine code

# Recordings' columns by the laboratory's names; "tautwire columns" proposes this table.
# [recording.columns]
# time = {{ name = "t_ms", unit = "ms" }}
# "winch_speed_{{}}" = {{ name = "Drive{{}}.Velocity", unit = "mm/s", sign = -1 }}

# A tracker's file beside the winches' log, given as --tracker: its clock where it is known, and its columns.
# [recording.tracker]
# clock_offset = 3.412            # s, what its clock shows at the first sample of the log
# [recording.tracker.columns]
# time = "Time (Seconds)"
# x = {{ name = "Rigid Body 1 X", unit = "mm" }}
"""


def new_robot_text(name: str, cable_count: int = 3) -> str:
    """The text of a template robot file with 2 to 12 cables, which can be built and run as it is.

    Exit points lie evenly on a circle above the platform, two in a plane with it; from six cables on, every second one
    below it.
    """
    has_lower_anchors = cable_count >= 6
    head = TEMPLATE_HEAD.format(
        name=json.dumps(name, ensure_ascii=False), preferred="600.0" if has_lower_anchors else "250.0"
    )
    return (
        head
        + "".join(_template_cable(number, cable_count, has_lower_anchors) for number in range(1, cable_count + 1))
        + TEMPLATE_TAIL.format(effects=_effect_names())
    )


def _effect_names() -> str:
    """The names of all effects, as comment lines."""
    names = ", ".join(effect.name for effect in ALL)
    return fill(names, 118, initial_indent="# ", subsequent_indent="# ")


def _template_cable(number: int, cable_count: int, has_lower_anchors: bool) -> str:
    angle = 2.0 * pi * (number - 1) / cable_count
    x, y = (round(4.0 * part, 3) + 0.0 for part in (cos(angle), sin(angle)))
    return TEMPLATE_CABLE.format(number=number, x=x, y=y, z=0.0 if has_lower_anchors and number % 2 == 0 else 5.0)
