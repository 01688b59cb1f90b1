"""The command line: ``tautwire build | simulate | linearise | workspace | trace | excite | material``."""

from __future__ import annotations

import sys

import typer

from .commands.fmus import build, simulate
from .commands.material import material
from .commands.plant import linearise, workspace
from .commands.tracing import excite, trace
from .errors import InputError, TautwireError

# The base of all errors of usage; newer typer hides it in a private module.
UsageError: type[Exception] = typer.BadParameter.__bases__[0]

DONE, FAILED, WRONG_INPUT = 0, 1, 2

application = typer.Typer(
    name="tautwire",
    help="Cable-driven parallel robots as FMI components, and a tracer that finds what their model lacks.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in (build, simulate, linearise, workspace, trace, excite, material):
    application.command()(command)


def main() -> None:
    """Run the command line; the exit status is 0 done, 2 the input is wrong, 1 anything else."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status; errors go to standard error, one line each."""
    try:
        status = application(arguments, standalone_mode=False)
    except (InputError, UsageError) as error:
        message = str(error) if isinstance(error, InputError) else error.format_message()  # type: ignore[attr-defined]
        return _say(message, WRONG_INPUT)
    except (TautwireError, OSError) as error:
        return _say(str(error), FAILED)
    except (KeyboardInterrupt, typer.Abort):
        status = FAILED
    # Newer typer turns Ctrl-C into a status that it returns.
    return _say("interrupted; nothing was written", FAILED) if status else DONE


def _say(message: str, status: int) -> int:
    print("tautwire: " + " ".join(message.split()), file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
