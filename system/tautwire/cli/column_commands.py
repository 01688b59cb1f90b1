"""The command ``columns``: a proposal of what the columns of a recording are."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..robot.robot_file_reader import MAX_CABLES, read_robot
from .console import AsJson, CommandOutput, Quiet, TrackerFile, columns_command, command_provenance, shell_quoted

if TYPE_CHECKING:
    from ..recordings.column_proposal import ColumnProposal
    from ..recordings.winch_columns import ProposedFile
    from ..robot.schema import Robot


def columns(
    context: typer.Context,
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING.csv", help="A recording; CSV, Parquet, .mat or a ROS bag.")
    ],
    robot_file: Annotated[
        Path | None, typer.Argument(metavar="ROBOT.toml", help="The robot file, for cables and start.")
    ] = None,
    cables: Annotated[
        int | None, typer.Option(help="Number of cables, without a robot file.", min=1, max=MAX_CABLES)
    ] = None,
    tracker: TrackerFile = None,
    out: Annotated[Path | None, typer.Option(metavar="COLUMNS.toml", help="Output file of the table.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Propose what the columns of a recording are.

    By the words, numbers and units in their names, and by their values where these decide; what is doubtful has a
    comment. Check it, then give it as --columns.
    Beside a tracker's file the table has the columns of both.

    Example: tautwire columns log.csv robot.toml --out columns.toml
    """
    from ..atomic_output import atomic_file, refuse_other_formats, refuse_overwriting_inputs
    from ..recordings.column_proposal import proposal_text, without_positions
    from ..recordings.winch_columns import with_winch_scales

    output = CommandOutput(as_json, quiet)
    robot = None if robot_file is None else read_robot(robot_file)
    cable_count = _cable_count(recording, robot, cables)
    refuse_other_formats(out, ".toml")
    refuse_overwriting_inputs([path for path in (recording, robot_file, tracker) if path], [out] if out else [])
    log = _proposed(recording, cable_count, robot)
    of_tracker = None if tracker is None else _proposed(tracker, 0, robot)
    proposal = with_winch_scales(log, cable_count, robot, of_tracker)
    text, document = "", dict[str, object]()
    if tracker is not None and of_tracker is not None:
        proposal = without_positions(proposal, tracker)
        text = "\n" + proposal_text(tracker, of_tracker.proposal, 0)
        document = {"tracker": _listed(of_tracker.proposal)}
    text = proposal_text(recording, proposal, cable_count) + text
    if out is not None:
        with atomic_file(out) as scratch:
            provenance = command_provenance(context, recording, robot_file, tracker)
            scratch.write_text(provenance.comment() + text, encoding="utf-8")
    document = _listed(proposal) | document | ({"table": out} if out else {})
    output.result([text.rstrip("\n") if out is None else out], document)
    output.suggest_next(_next_step(recording, robot_file, cable_count, tracker, out))


def _proposed(path: Path, cable_count: int, robot: Robot | None) -> ProposedFile:
    """The proposal by names and values, and the samples."""
    from ..recordings.column_names import column_names
    from ..recordings.column_proposal import propose_columns, without_orientation
    from ..recordings.column_samples import column_samples
    from ..recordings.value_proposal import with_values
    from ..recordings.winch_columns import ProposedFile

    by_names, samples = propose_columns(column_names(path), cable_count), column_samples(path)
    if robot is not None and not robot.platform.is_rigid_body:
        by_names = without_orientation(by_names)
    return ProposedFile(with_values(by_names, samples, cable_count, robot), samples)


def _listed(proposal: ColumnProposal) -> dict[str, object]:
    """The proposal as a JSON object."""
    return {
        "columns": [asdict(each) for each in proposal.columns],
        "standard_names": sorted(proposal.standard_names),
        "unused": proposal.unused,
    }


def _cable_count(recording: Path, robot: Robot | None, cables: int | None) -> int:
    """The number of cables, by the robot file, the option, or the columns' names.

    Raises InputError where none of these tells it, or the first two differ.
    """
    if robot is None and cables is None:
        return _named_cable_count(recording)
    cable_count = cables if robot is None else robot.cable_count
    if cable_count is None or (cables is not None and cables != cable_count):
        raise InputError("--cables", f"is {cables}, the robot has {cable_count}", "omit one of the two")
    return cable_count


def _named_cable_count(recording: Path) -> int:
    """The number of cables by the columns' names; raises InputError where these have no numbers."""
    from ..recordings.column_names import column_names
    from ..recordings.column_proposal import likely_cable_count

    cable_count = likely_cable_count(column_names(recording))
    if not cable_count:
        problem = f"is missing, and no column of {recording} has the number of a cable"
        raise InputError("--cables", problem, "name the robot file, or give the number, as in --cables 4")
    return cable_count


def _next_step(
    recording: Path, robot_file: Path | None, cable_count: int, tracker: Path | None, out: Path | None
) -> str:
    """What is to be done with a proposal: write it, then check the recording with it."""
    if out is None:
        source = f"--cables {cable_count}" if robot_file is None else shell_quoted(robot_file)
        return f"{columns_command(recording, source, tracker)} --out columns.toml"
    of_tracker = f" --tracker {shell_quoted(tracker)}" if tracker else ""
    options = f"--columns {shell_quoted(out)}{of_tracker}"
    if robot_file is None:
        return f"read it, then check the recording with your robot file: {options}"
    return f"read it, then tautwire check {shell_quoted(robot_file)} {shell_quoted(recording)} {options}"
