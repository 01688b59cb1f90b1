"""Edits robot files: only changed values of the owner's text are replaced, so comments, order and layout stay."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from ..errors import RobotFileError
from ..provenance import COMMENT_STARTS
from ..toml_text import parse_toml
from .robot_file_reader import robot_file_text, robot_from_text
from .robot_file_text import completed_robot, robot_text
from .schema import Robot

# Tables that are lists, or whose order counts; all others are edited key by key.
LISTED_TABLES = ("effect", "formula")


def edited_robot_text(source: str | Path, robot: Robot, target: str | Path) -> str | None:
    """The text of a robot file, changed to declare another robot; None where no edit of it reads back equal.

    Changed numbers keep the comments beside them; tables that are new come last. Comments that an earlier run wrote on
    its provenance are removed.
    """
    try:
        text = robot_file_text(source)
        before = robot_from_text(text, source, Path(source).stem)
    except RobotFileError:
        return None
    text = _without_provenance(text)
    changed_tables = () if before.formulas == robot.formulas else ("formula",)
    # To write all effects anew keeps their order where the smaller edit does not.
    edits = (_checked_edit(text, before, robot, tables, target) for tables in (changed_tables, LISTED_TABLES))
    return next((edited for edited in edits if edited is not None), None)


def _checked_edit(
    text: str, before: Robot, robot: Robot, replaced_tables: tuple[str, ...], target: str | Path
) -> str | None:
    """The edited text; None where tomlkit cannot edit it, or what it made of it declares another robot."""
    try:
        edited = _edited_text(text, before, robot, replaced_tables)
        reads_back = robot_from_text(edited, target, Path(target).stem) == completed_robot(robot)
    except (TOMLKitError, RobotFileError, KeyError, TypeError, ValueError):
        return None
    return edited if reads_back else None


def _edited_text(text: str, before: Robot, robot: Robot, replaced_tables: tuple[str, ...]) -> str:
    document = tomlkit.parse(text)
    new_document = tomlkit.parse(robot_text(robot))
    old, new = parse_toml(robot_text(before)), new_document.unwrap()
    for key in [key for key in old if key not in new and key in document]:
        del document[key]
    for key, value in new.items():
        if key == "cable":
            _edit_cables(document, old[key], new_document[key])
        elif key == "fmu":
            # Paths relative to the source would name other files beside the target.
            _edit_table(document, key, dict.fromkeys(old.get(key, {}), ""), new_document)
        elif key == "effect" and key not in replaced_tables:
            _edit_effects(document, old.get(key, {}), value, new_document[key])
        elif key in replaced_tables:
            document.pop(key, None)
        elif isinstance(value, dict):
            _edit_table(document, key, old.get(key, {}), new_document)
        elif key in document and value != old.get(key):
            document[key] = value
    edited = tomlkit.dumps(document)
    if "name" not in document:
        edited = tomlkit.dumps({"name": robot.name}) + edited
    return _with_tables_added(edited, new_document)


def _edit_cables(document: MutableMapping[str, Any], old: list[Any], new: list[Any]) -> None:
    for table, old_values, new_values in zip(document["cable"], old, new, strict=True):
        _edit_values(table, old_values, new_values)


def _edit_table(
    document: MutableMapping[str, Any], key: str, old: Mapping[str, Any], new_document: Mapping[str, Any]
) -> None:
    if key in document:
        _edit_values(document[key], old, new_document[key])


def _edit_effects(
    document: MutableMapping[str, Any], old: Mapping[str, Any], new: Mapping[str, Any], commented: Mapping[str, Any]
) -> None:
    """Edits effects that have one table before and after; removes others that changed."""
    effects = document.get("effect", {})
    for name in list(effects):
        if name in new and old.get(name) == new[name]:
            continue
        if name in new and all(isinstance(each[name], dict) for each in (effects, old, new)):
            _edit_values(effects[name], old[name], commented[name])
        else:
            del effects[name]


def _edit_values(table: MutableMapping[str, Any], old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    """Sets the values of a table that differ between the robots; a new key has the writer's comment."""
    for key in [key for key in old if key not in new]:
        table.pop(key, None)
    for key, value in new.items():
        if key not in table:
            if value != old.get(key):
                table[key] = value
        elif value != old.get(key):
            table[key] = value.unwrap() if hasattr(value, "unwrap") else value


def _with_tables_added(text: str, new_document: Mapping[str, Any]) -> str:
    """The text with those tables at its end that only the new document has, as the writer comments them."""
    existing = parse_toml(text)
    blocks = [block for block in tomlkit.dumps(new_document).split("\n\n") if _is_absent(parse_toml(block), existing)]
    joined = "\n\n".join([text.rstrip("\r\n"), *(block.rstrip("\n") for block in blocks)]) + "\n" if blocks else text
    return joined.replace("\r\n", "\n").replace("\n", "\r\n") if "\r\n" in text else joined


def _is_absent(block: Mapping[str, Any], existing: Mapping[str, Any]) -> bool:
    """Whether a block of the writer is a table that the text does not have."""
    ((key, value), *others) = block.items()
    if others or not isinstance(value, dict | list) or key == "cable":
        return False
    if key == "effect":
        return not set(value) & set(existing.get("effect", {}))
    return key not in existing


def _without_provenance(text: str) -> str:
    lines = text.splitlines(keepends=True)
    count = next((number for number, line in enumerate(lines) if not line.startswith(COMMENT_STARTS)), len(lines))
    is_followed_by_blank = count > 0 and count < len(lines) and not lines[count].strip()
    return "".join(lines[count + is_followed_by_blank :])
