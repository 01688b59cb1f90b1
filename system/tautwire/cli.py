"""The command line: ``tautwire new | check | build | simulate | trace`` and more, see ``tautwire --help``."""

from __future__ import annotations

import inspect
import sys
import tempfile
from collections.abc import Callable
from typing import Annotated

import typer

from . import __version__
from .commands.campaign import campaign
from .commands.fmus import build, fmus, simulate
from .commands.material import material
from .commands.paper import paper
from .commands.plant import linearise, workspace
from .commands.robot_file import check, new
from .commands.tracing import excite, trace
from .errors import InputError, TautwireError
from .interrupt import end_like_interrupts
from .streams import flush_or_drop, open_missing, say

# The base of all errors of usage; newer typer hides it in a private module.
UsageError: type[Exception] = typer.BadParameter.__bases__[0]

DONE, FAILED, WRONG_INPUT = 0, 1, 2


COMMANDS = (new, check, build, fmus, simulate, linearise, workspace, trace, excite, material, campaign, paper)


def _text_and_example(command: Callable[..., None]) -> tuple[str, str]:
    text, _, example = inspect.cleandoc(command.__doc__ or "").partition("Example: ")
    return text, example


def help_of(command: Callable[..., None]) -> str:
    """What a command's docstring says, with its last paragraph, the example, on a line of its own."""
    text, example = _text_and_example(command)
    # A line with a backspace alone keeps click from breaking the lines of a paragraph anew.
    return f"{text}\b\nExample: {example}" if example else text


application = typer.Typer(
    name="tautwire",
    help="Cable-driven parallel robots as FMI components, and a tracer that finds what their model lacks.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in COMMANDS:
    application.command(help=help_of(command))(command)


def _say_version(wanted: bool) -> None:
    if wanted:
        print(f"tautwire {__version__}")
        raise typer.Exit()


@application.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Cable-driven parallel robots as FMI components, and a tracer that finds what their model lacks."""


def main() -> None:
    """Run the command line; the exit status is 0 done, 2 the input is wrong, 1 anything else."""
    open_missing()
    end_like_interrupts()
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status; errors go to standard error, one line each."""
    try:
        status = application(arguments or ["--help"], prog_name="tautwire", standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        return _say(f"{error}{_example(arguments) if _is_of_usage(error) else ''}", WRONG_INPUT)
    except UsageError as error:
        message = error.format_message().rstrip(".")  # type: ignore[attr-defined]
        return _say(f"{message}{_example(arguments)}", WRONG_INPUT)
    except TautwireError as error:
        return _say(str(error), FAILED)
    except OSError as error:
        flush_or_drop(sys.stdout)
        # Nobody reads on, as in "| head": there is nothing to be told.
        return FAILED if isinstance(error, BrokenPipeError) else _say(_system_error(error), FAILED)
    except MemoryError:
        return _say("this takes more memory than there is: give a shorter recording, or free some", FAILED)
    except (KeyboardInterrupt, typer.Abort):
        status = FAILED
    if status == WRONG_INPUT:
        return WRONG_INPUT
    # Newer typer turns Ctrl-C into a status that it returns.
    return _say("interrupted; nothing was written", FAILED) if status else DONE


def _is_of_usage(error: InputError) -> bool:
    """Whether an option or argument is wrong, not a file: files and their keys have no dashes in front."""
    return error.where.startswith("--") or error.where == "NAME"


def _example(arguments: list[str]) -> str:
    """The example of the command that was asked for, to end a line with; that of help where there is none such."""
    examples = {command.__name__: _text_and_example(command)[1] for command in COMMANDS}
    asked = next((examples[word] for word in arguments if word in examples), "tautwire --help")
    return f"; example: {asked}"


def _system_error(error: OSError) -> str:
    """What the system refused, and where; for what has no name."""
    place = error.filename or f"standard output, or a temporary file in {tempfile.gettempdir()}"
    return f"{place}: {error.strerror or error}"


def _say(message: str, status: int) -> int:
    say("tautwire: " + " ".join(message.split()))
    return status


if __name__ == "__main__":
    main()
