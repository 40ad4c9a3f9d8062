"""The command group, and the one place that turns every refusal into an exit code."""

from __future__ import annotations

import atexit
import errno
import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module

import click

from lagrange_cli.cli.session import INTERRUPTED, Session, report_error
from lagrange_cli.cli.terminal.interrupts import Terminated, termination
from lagrange_cli.cli.terminal.output import give_up_stdout
from lagrange_cli.cli.terminal.streams import prepare_streams
from lagrange_cli.errors import InputError, InternalError, LagrangeError, Problem
from lagrange_cli.version import __version__

#: The subcommands, in the order in which help lists them, and what it says of each. Each is a
#: function in a module of its name; :data:`_FUNCTIONS` and :data:`_MODULES` have the others.
COMMANDS = {
    "derive": "Degrees of freedom, Lagrangian and equations of motion.",
    "emit": "Code, a document or a sketch: LaTeX, Typst, C, Python, TikZ, SVG.",
    "analyze": "Symmetries, equilibria and their stability, linear system, modes.",
    "simulate": "A trajectory to the accuracy that you state.",
    "show": "A page on which the system moves, with sliders, plots and the equations.",
    "path": "Paths of stationary action between two configurations.",
    "tradeoff": "Speed against accuracy of every method, measured.",
    "stress": "Results at extremes, which hold, degrade or are refused.",
    "fit": "Parameters and starts that fit measurements.",
    "check": "Scenes and folders, compared with what they expect.",
    "fmt": "The usual layout of scenes, comments kept.",
    "new": "A commented scene to begin with.",
    "import": "A scene from the description of a robot: URDF, MJCF.",
    "schema": "JSON Schema of scenes, for editors.",
    "lsp": "A language server for editors.",
    "config": "Defaults of options that hold here, and their file.",
    "cache": "The results kept from earlier runs, shown or removed.",
}

#: Subcommand → its function, whose name is another where that of the command is a word of Python.
_FUNCTIONS = {"import": "import_robot"}

#: Function of a subcommand → its module, where that has another name.
_MODULES = {"lsp": "editors", "schema": "editors"}

_REPORT = (
    "this is a defect of lagrange and not of your scene; please report it with the\n"
    "scene and the command; --traceback shows where it happened"
)

#: Thresholds of the garbage collector. Expressions are many and hardly ever garbage: by Python's
#: own thresholds half of the time of a large scene would go into walking them. The first is beyond
#: the objects that an import of SymPy makes, some 100,000, none of them garbage. By the second
#: 30 million objects are made before those of the first look are looked at again.
COLLECTION = (300_000, 100, 50)

#: Results that SymPy keeps of each of its functions. A large scene displaces SymPy's own 1,000
#: before they are asked for again; beyond these, further ones save nothing.
_SYMPY_CACHE = 65_536

_IMPORTS = "it is not installed as it should be, or there is no memory for it"

_MEMORY = "memory is limited by the machine or for this process (ulimit -v)"

#: Errors of a system that has run out of something, whatever was asked for.
_SPENT = (
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENOMEM, errno.EAGAIN),
    *(errno.EMFILE, errno.ENFILE, errno.EBADF),
)

#: Digits of the longest whole number that is written out: constants of scenes have up to 20,000.
_LONGEST_NUMBER = 200_000


class _Commands(click.Group):
    """The subcommands, each imported when it is called or asked about by name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        function = _FUNCTIONS.get(cmd_name, cmd_name)
        module = _MODULES.get(function, function)
        command = getattr(import_module(f"lagrange_cli.cli.commands.{module}"), function)
        assert isinstance(command, click.Command)
        command.short_help = COMMANDS[cmd_name]
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands, and import none of them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Results go to stdout, remarks to stderr. Exit codes: 0 all well, 1 a check did not "
    "hold or an accuracy was not reached, 2 the input is wrong, 3 internal error.",
)
@click.version_option(__version__, prog_name="lagrange")
def lagrange() -> None:
    """Equations of motion from a scene file: derived, certified, emitted, simulated."""


def _is_of_machine(error: Exception) -> bool:
    """Say whether the machine, or what is installed on it, is the reason, and not this program."""
    if isinstance(error, ImportError):
        return not (error.name or "").startswith("lagrange_cli")
    return isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno in _SPENT)


def _machine_problem(error: Exception, stage: str) -> Problem:
    """Report that the machine lacks something, and the stage of the work."""
    if isinstance(error, ImportError):
        lines = [line.strip() for line in str(error).splitlines() if line.strip()] or [""]
        says = f"a library cannot be loaded, while {stage}: {error.name or lines[-1]}"
        return Problem(says, hint=f"{_IMPORTS}; {_MEMORY}", rule="machine")
    if isinstance(error, OSError):
        return Problem(f"the system gives no more: {error.strerror}", rule="machine")
    return Problem(f"out of memory, while {stage}", hint=_MEMORY, rule="machine")


def _explain(error: Exception, session: Session) -> int:
    """Report an exception on stderr and return the exit code it stands for."""
    if session.traceback:
        import traceback

        click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
    if isinstance(error, click.ClickException):
        error.show()
        return error.exit_code
    if isinstance(error, LagrangeError):
        for problem in error.problems:
            report_error(problem)
        if isinstance(error, InternalError):
            report_error(Problem("internal error", hint=_REPORT))
        return error.exit_code
    if _is_of_machine(error):
        # What its frames hold is the memory that a message takes.
        error.__traceback__ = error.__context__ = None
        give_up_stdout()
        report_error(_machine_problem(error, session.stage))
        return InputError.exit_code
    kind = type(error).__name__
    report_error(Problem(f"internal error: {kind}: {error}", hint=_REPORT))
    return InternalError.exit_code


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments
        The words after ``lagrange``; those of the process if None.
    """
    session = Session()
    sys.set_int_max_str_digits(_LONGEST_NUMBER)
    try:
        with termination():
            code = lagrange.main(arguments, "lagrange", standalone_mode=False, obj=session)
    except click.Abort:
        report_error(Problem("interrupted"))
        return INTERRUPTED
    except Terminated as ended:
        hung_up = ended.number != signal.SIGTERM
        report_error(Problem("hung up" if hung_up else "terminated"))
        return 128 + ended.number
    except Exception as error:
        return _explain(error, session)
    return code if isinstance(code, int) else 0


def _end_at_once(codes: Sequence[int]) -> None:
    """End the process with the first of some exit codes, if there is any."""
    if codes:
        for stream in (sys.stdout, sys.stderr):
            with suppress(AttributeError, OSError, ValueError):
                stream.flush()
        os._exit(codes[0])


def main() -> None:
    """Entry point of the command ``lagrange``."""
    interrupted: list[int] = []
    # What is registered first is called last: all others have tidied up.
    atexit.register(_end_at_once, interrupted)
    prepare_streams()
    gc.set_threshold(*COLLECTION)
    os.environ.setdefault("SYMPY_CACHE_SIZE", str(_SYMPY_CACHE))  # read as SymPy is imported
    code = run()
    # Else the interpreter looks through all objects for garbage before it ends, several times.
    gc.freeze()
    if code == INTERRUPTED:
        # ``python -m`` sends itself the signal where it passed through an ``exec`` of a library,
        # and a thread of another library takes it although this one blocks it.
        interrupted.append(code)
    sys.exit(code)
