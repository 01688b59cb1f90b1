"""What the columns of a ROS bag measure, in the words that proposals of columns know."""

from __future__ import annotations

import re

from .ros_bag import BagColumn

# Words of a joint's numbers: a revolute joint has rad, rad/s and N m.
_JOINT_WORDS = {"velocity": "omega", "position": "angle", "effort": "effort"}
_POINT_TYPES = ("/Point", "/PointStamped")
_POINT = re.compile(r"(?:.*\.)?(?:position|translation|point)\.([xyz])")
_QUATERNION = re.compile(r"(?:.*\.)?(?:orientation|rotation)\.([wxyz])")
_FORCE = re.compile(r"(?:.*\.)?force\.[xyz]")
_OTHER_FIELDS = ("twist", "linear", "angular", "covariance", "orientation", "rotation", "torque", "layout")
_PLURALS = re.compile(r"(?<=[a-z]{3})s(?![a-z])")
_LABEL = re.compile(r"\[([^\[\]]*)\]")


def column_words(column: BagColumn) -> str:
    """Words of a column with the number of its cable, blank where it is none of a recording.

    A joint's velocity, position and effort are its drum's; a point and a quaternion are the platform's; a force along
    one axis is a tension where the others are zero; any other number is what its topic and field are called.
    """
    labels = _LABEL.findall(column.path)
    path = _LABEL.sub("", column.path)
    # The number of the cable is the entry's, if there is one.
    subject = re.sub("[0-9]", " ", column.topic) if labels else column.topic
    label = " ".join(labels)
    point = _POINT.fullmatch(f"point.{path}" if column.message_type.endswith(_POINT_TYPES) else path)
    if point:
        return f"position {point.group(1)}"
    quaternion = _QUATERNION.fullmatch(path)
    # That of an inertial measurement unit is its own, not the platform's.
    if quaternion and not column.message_type.endswith("/Imu"):
        return f"quaternion {quaternion.group(1)}"
    if column.message_type.endswith("/JointState"):
        return f"{_JOINT_WORDS.get(path, '')} {label}"
    if _FORCE.fullmatch(path):
        return "" if column.is_zero else _singular(f"force {subject} {label}")
    if any(part in _OTHER_FIELDS for part in path.split(".")):
        return ""
    return _singular(f"{subject} {path} {label}")


def _singular(text: str) -> str:
    """Words parted by spaces, and without the s of a plural."""
    words = re.sub("[/._]", " ", text).replace("velocities", "velocity")
    return _PLURALS.sub("", words).strip()
