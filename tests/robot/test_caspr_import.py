"""Robots of CASPR: what a robot file takes over, what is assumed, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.cli import run
from tautwire.robot.caspr_import import CasprError, Rope, read_caspr_robot
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.static_equilibrium import static_tensions
from tautwire_fmu.laws.rotation import rotation_matrix

MASS, CENTRE = 40.0, (0.02, -0.01, 0.3)
ENTRIES = {"Ixx": 9.0, "Iyy": 8.0, "Izz": 5.0, "Ixy": -0.2, "Ixz": 0.5, "Iyz": -0.3}
CORNERS = [(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
# Two cables from each corner of a hall of 8 x 6 x 4 m, crossed at the platform.
ENDS = [((4.0 * x, 3.0 * y, 4.0), (0.4 * x * s, -0.3 * y * s, 0.5 * (1 - s))) for x, y in CORNERS for s in (1, -1)]


def bodies(reference: str = "com", joint: str = "SPATIAL_EULER_XYZ", pose: str = "0 0 1 0 0 0", links: int = 1) -> str:
    entries = "".join(f"<{name}>{value}</{name}>" for name, value in ENTRIES.items())
    initial = f'q_initial="{pose}"' if pose else ""
    link = f"""<link_rigid num="1" name="Hall"><joint type="{joint}" {initial}/><physical><mass>{MASS}</mass>
    <com_location>{" ".join(map(str, CENTRE))}</com_location><inertia ref="{reference}">{entries}</inertia></physical>
    <parent><num>0</num><location>0.5 0 0</location></parent></link_rigid>"""
    return f'<?xml version="1.0"?><bodies_system><links>{links * link}</links></bodies_system>'


def attachment(link: int, place: tuple[float, float, float]) -> str:
    return f"<attachment><link>{link}</link><location>{' '.join(map(str, place))}</location></attachment>"


def pulley(place: tuple[float, float, float], radius: float) -> str:
    return f"""<base_rotating_pulley><fixed_location>{" ".join(map(str, place))}</fixed_location>
    <pulley_radius>{radius}</pulley_radius><cable_entry_vector>0 0 2</cable_entry_vector></base_rotating_pulley>"""


def cables(kind: str = "cable_ideal", reference: str = "joint", pulleys: bool = False, more: str = "") -> str:
    texts = []
    for index, (anchor, place) in enumerate(ENDS):
        outlet = pulley(anchor, 0.04 + 0.01 * (index > 5)) if pulleys else attachment(0, anchor)
        stiffness = "<K>500000</K>" if kind == "cable_linear_spring" else ""
        texts.append(f"""<{kind} name="{index + 1}" attachment_reference="{reference}">
        <properties>{stiffness}<force_min>{10 + (index == 3)}</force_min><force_max>1011</force_max></properties>
        <attachments>{outlet}{attachment(1, place)}{more}</attachments></{kind}>""")
    sets = f'<cable_set id="original">{"".join(texts)}</cable_set><cable_set id="spare"></cable_set>'
    return f'<!DOCTYPE cables SYSTEM "cables.dtd"><cables default_cable_set="original">{sets}</cables>'


def model(folder: Path, body_text: str = "", cable_text: str = "") -> Path:
    (folder / "Hall_bodies.xml").write_text(body_text or bodies(), encoding="utf-8")
    (folder / "Hall_cables.xml").write_text(cable_text or cables(), encoding="utf-8")
    return folder


def test_geometry_mass_and_limits_are_taken_over(tmp_path: Path) -> None:
    robot = read_caspr_robot(model(tmp_path)).robot
    assert (robot.name, robot.platform.mass, robot.platform.start) == ("Hall", MASS, (0.5, 0.0, 1.0))
    assert robot.platform.inertia == ((9.0, -0.2, 0.5), (-0.2, 8.0, -0.3), (0.5, -0.3, 5.0))
    assert robot.platform.centre_of_mass == CENTRE
    assert [(each.anchor, each.attachment) for each in robot.cables] == ENDS
    assert robot.tension is not None
    assert (robot.tension.minimum, robot.tension.maximum, robot.tension.preferred) == (11.0, 1011.0, 111.0)


def test_the_preferred_tension_leaves_no_cable_slack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The weight makes four cables from above carry more than four from below.
    corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    ends = [((0.5 + 2.0 * x, 2.0 * y, 1.0 + 0.5 * z), (0.2 * x, -0.2 * y, -0.1 * z)) for x, y, z in corners]
    monkeypatch.setattr("tests.robot.test_caspr_import.ENDS", ends)
    imported = read_caspr_robot(model(tmp_path, bodies(pose="0 0 1 0 0 0")))
    limits = imported.robot.tension
    assert limits is not None and limits.preferred > 111.0
    assert static_tensions(imported.robot).min() > limits.minimum + 0.01 * (limits.maximum - limits.minimum)
    share = (limits.preferred - limits.minimum) / (limits.maximum - limits.minimum)
    assert any(f"{limits.preferred:g} N, {100.0 * share:.0f} % up" in note for note in imported.notes)


def test_an_inertia_about_the_joint_is_shifted_to_the_centre_of_mass(tmp_path: Path) -> None:
    platform = read_caspr_robot(model(tmp_path, bodies("joint"))).robot.platform
    # About the joint: that of 40 kg at the centre of mass on top, point by point.
    x, y, z = CENTRE
    shift = MASS * np.array(
        [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z], [-x * z, -y * z, x * x + y * y]]
    )
    stated = np.array([[9.0, -0.2, 0.5], [-0.2, 8.0, -0.3], [0.5, -0.3, 5.0]])
    assert np.array(platform.inertia) == pytest.approx(stated - shift, rel=1e-14)


@pytest.mark.parametrize(
    ("joint", "pose"), [("SPATIAL_EULER_XYZ", "1 2 3 0.3 -0.2 0.5"), ("SPATIAL_QUATERNION", "1 2 3 0.9 0.1 -0.3 0.2")]
)
def test_the_initial_pose_is_the_start(tmp_path: Path, joint: str, pose: str) -> None:
    platform = read_caspr_robot(model(tmp_path, bodies(joint=joint, pose=pose))).robot.platform
    about_x, about_y, about_z = (
        Rotation.from_euler(axis, angle) for axis, angle in zip("xyz", (0.3, -0.2, 0.5), strict=True)
    )
    euler, quaternion = about_x * about_y * about_z, Rotation.from_quat([0.1, -0.3, 0.2, 0.9])
    expected = euler if joint == "SPATIAL_EULER_XYZ" else quaternion
    assert platform.start == (1.5, 2.0, 3.0)
    assert np.array(rotation_matrix(platform.start_orientation)) == pytest.approx(expected.as_matrix(), abs=1e-14)


def test_attachments_may_count_from_the_centre_of_mass(tmp_path: Path) -> None:
    robot = read_caspr_robot(model(tmp_path, cable_text=cables(reference="com"))).robot
    expected = [np.array(place) + CENTRE for _, place in ENDS]
    assert np.array([each.attachment for each in robot.cables]) == pytest.approx(np.array(expected))
    assert [each.anchor for each in robot.cables] == [anchor for anchor, _ in ENDS]


def test_rotating_pulleys_are_an_effect_for_each_radius(tmp_path: Path) -> None:
    robot = read_caspr_robot(model(tmp_path, cable_text=cables(pulleys=True))).robot
    assert [(each.values["radius"], each.cables) for each in robot.effects] == [
        (0.04, (1, 2, 3, 4, 5, 6)),
        (0.05, (7, 8)),
    ]
    assert {each.swivel_axis for each in robot.cables} == {(0.0, 0.0, 1.0)}


def test_springs_keep_their_stiffness_and_ideal_ropes_get_the_stated_one(tmp_path: Path) -> None:
    springs = read_caspr_robot(model(tmp_path, cable_text=cables("cable_linear_spring"))).robot
    assert [each.modulus * each.area for each in springs.cables] == pytest.approx([5e5] * 8)
    ideal = read_caspr_robot(model(tmp_path), rope=Rope(modulus=6e10, area=1e-5, damping=0.0))
    assert {(each.modulus, each.area, each.damping) for each in ideal.robot.cables} == {(6e10, 1e-5, 0.0)}
    assert any("modulus 6e+10 Pa" in note for note in ideal.notes)


def test_what_is_assumed_or_left_out_is_told(tmp_path: Path) -> None:
    (tmp_path / "Hall_trajectories.xml").write_text("<trajectories/>", encoding="utf-8")
    notes = "\n".join(read_caspr_robot(model(tmp_path, bodies(pose=""))).notes)
    for words in ("no pose", "gravity 9.81", "preferred", "limits differ", "sets spare", "Hall_trajectories.xml"):
        assert words in notes


@pytest.mark.parametrize(
    ("body_text", "cable_text", "cable_set", "words"),
    [
        (bodies(links=2), "", None, "2 rigid links"),
        (bodies(joint="PLANAR_XY"), "", None, "its joint is PLANAR_XY"),
        (bodies("hip"), "", None, "ref is 'hip'"),
        (bodies(pose="0 0 1"), "", None, "<q_initial> is '0 0 1'; give 6 finite numbers"),
        ("<bodies", "", None, "no valid XML"),
        ("", cables("cable_vsd_torsion_spring"), None, "is a cable_vsd_torsion_spring"),
        ("", cables(more=attachment(1, (0.0, 0.0, 0.0))), None, "cable '1' has 3 attachments"),
        ("", "", "pulleys", "no cable set 'pulleys'; choose among original, spare"),
        ("", "", "spare", "its cable set is empty"),
        ("", cables("muscle_hill_type"), None, "is a muscle_hill_type"),
        (bodies(joint="SPATIAL_QUATERNION", pose="0 0 1 0 0 0 0"), "", None, "<q_initial> has only zeros"),
        ("", cables(pulleys=True).replace("0 0 2", "0 0 0"), None, "<cable_entry_vector> has only zeros"),
        (bodies().replace(f"<mass>{MASS}", "<mass>0"), "", None, "platform.mass: is 0"),
        ("", cables().replace("1011", "5"), None, "tension"),
    ],
)
def test_what_no_robot_file_can_have_is_refused(
    tmp_path: Path, body_text: str, cable_text: str, cable_set: str | None, words: str
) -> None:
    with pytest.raises(CasprError) as caught:
        read_caspr_robot(model(tmp_path, body_text, cable_text), cable_set)
    assert words in str(caught.value)


def test_a_folder_of_no_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CasprError, match="has 0 files"):
        read_caspr_robot(tmp_path)
    with pytest.raises(CasprError, match="is no folder"):
        read_caspr_robot(tmp_path / "absent")


def test_the_command_writes_a_robot_file_that_can_be_linearised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, plant = tmp_path / "hall.toml", tmp_path / "model.json"
    assert run(["import", str(model(tmp_path)), "--out", str(robot), "--area", "2e-5"]) == 0
    assert "assumed, as CASPR has none" in capsys.readouterr().err
    text = robot.read_text(encoding="utf-8")
    assert "# assumed, as CASPR has none" in text
    assert "tautwire import " in text and len(re.findall(r"\b[0-9a-f]{64}\b", text)) == 2
    assert read_robot(robot) == read_caspr_robot(tmp_path, rope=Rope(area=2e-5)).robot
    assert run(["linearise", str(robot), "--out", str(plant)]) == 0
    assert run(["import", str(tmp_path), "--out", str(robot), "--modulus", "-1"]) == 2
