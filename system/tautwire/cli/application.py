"""The command line: ``tautwire new | example | check | build | simulate | trace`` and more, see ``tautwire --help``."""

from __future__ import annotations

import inspect
import sys
import tempfile
from collections.abc import Callable
from io import TextIOWrapper
from typing import Annotated

import typer

from .. import __version__
from ..errors import InputError, TautwireError
from ..process_signals import raise_interrupt_on_termination
from ..provenance import command_text
from .analysis_commands import linearise, workspace
from .batch_commands import campaign, paper
from .column_commands import columns
from .console import INTERRUPTED, flush_or_discard, open_closed_streams, print_error
from .fmu_commands import build, fmus
from .identification_commands import excite, material, trace
from .pose_command import pose
from .robot_file_commands import check, example, import_, new
from .simulation_command import simulate

# The base class of usage errors; newer typer hides it in a private module.
UsageError: type[Exception] = typer.BadParameter.__bases__[0]

EXIT_SUCCESS, EXIT_FAILURE, EXIT_WRONG_INPUT = 0, 1, 2


COMMANDS = (
    new,
    example,
    import_,
    check,
    columns,
    build,
    fmus,
    simulate,
    pose,
    linearise,
    workspace,
    trace,
    excite,
    material,
    campaign,
    paper,
)


def command_name(command: Callable[..., None]) -> str:
    """The name of a command: its function's, without the underscore behind a word of Python's."""
    return command.__name__.rstrip("_")


def _split_docstring(command: Callable[..., None]) -> tuple[str, str]:
    text, _, example = inspect.cleandoc(command.__doc__ or "").partition("Example: ")
    return text, example


def help_text(command: Callable[..., None]) -> str:
    """The help text of a command: its docstring, with the example on a line of its own."""
    text, example = _split_docstring(command)
    # A line with a lone backspace keeps click from rewrapping a paragraph.
    return f"{text}\b\nExample: {example}" if example else text


app = typer.Typer(
    name="tautwire",
    help="Co-simulation of cable-driven parallel robots as FMI components, and identification of their models.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in COMMANDS:
    app.command(name=command_name(command), help=help_text(command))(command)


def _print_version(requested: bool) -> None:
    if requested:
        print(f"tautwire {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Co-simulation of cable-driven parallel robots as FMI components, and identification of their models."""


def main() -> None:
    """Runs the command line; the exit status is 0 for success, 2 for invalid input, 1 for any other failure."""
    open_closed_streams()
    # Names of files and columns may hold characters that standard output's encoding lacks.
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    raise_interrupt_on_termination()
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Runs one command and returns its exit status; errors go to standard error, one line each."""
    try:
        status = app(arguments or ["--help"], prog_name="tautwire", standalone_mode=False, obj=command_text(arguments))
        sys.stdout.flush()
    except InputError as error:
        return _report_error(f"{error}{_example_suffix(arguments) if _is_usage_error(error) else ''}", EXIT_WRONG_INPUT)
    except UsageError as error:
        message = error.format_message().rstrip(".")  # type: ignore[attr-defined]
        return _report_error(f"{message}{_example_suffix(arguments)}", EXIT_WRONG_INPUT)
    except TautwireError as error:
        return _report_error(str(error), EXIT_FAILURE)
    except OSError as error:
        flush_or_discard(sys.stdout)
        # The reader closed the pipe, as in "| head": no message is needed.
        return (
            EXIT_FAILURE if isinstance(error, BrokenPipeError) else _report_error(_format_os_error(error), EXIT_FAILURE)
        )
    except MemoryError:
        return _report_error("not enough memory: give a shorter recording, or free memory", EXIT_FAILURE)
    except typer.Abort as abort:
        # typer makes one of any EOFError, as of a damaged .pyc file, which is no interrupt.
        if isinstance(abort.__cause__, EOFError):
            raise abort.__cause__ from None
        status = EXIT_FAILURE
    except KeyboardInterrupt:
        status = EXIT_FAILURE
    if status == EXIT_WRONG_INPUT:
        return EXIT_WRONG_INPUT
    # Newer typer returns a status for Ctrl-C.
    return _report_error(INTERRUPTED, EXIT_FAILURE) if status else EXIT_SUCCESS


def _is_usage_error(error: InputError) -> bool:
    """Whether an option or argument is invalid, rather than a file: only options begin with dashes."""
    return error.where.startswith("--") or error.where == "NAME"


def _example_suffix(arguments: list[str]) -> str:
    """The example of the requested command, to end an error message with; that of help for an unknown command."""
    examples = {command_name(command): _split_docstring(command)[1] for command in COMMANDS}
    example = next((examples[word] for word in arguments if word in examples), "tautwire --help")
    return f"; example: {example}"


def _format_os_error(error: OSError) -> str:
    """A system error as text, with the file it concerns; standard output where the error names none."""
    target = error.filename or f"standard output, or a temporary file in {tempfile.gettempdir()}"
    return f"{target}: {error.strerror or error}"


def _report_error(message: str, status: int) -> int:
    print_error("tautwire: " + " ".join(message.split()))
    return status
