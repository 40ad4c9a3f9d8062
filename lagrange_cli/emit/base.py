"""An output format and its options, and the contract that every format keeps.

The contract of a format:

1. ``emit`` is a pure function: the same equations and options give the same
   bytes, whatever the hash seed, the machine or the day.
2. It returns file names (no folders) with their text, those of
   :meth:`Emitter.files`: ``NAME.EXT`` with ``NAME`` = ``equations.name``,
   changed if it is ``reserved``, and ``EXT`` one of ``extensions``. It
   writes nothing itself.
3. Text from a scene (titles, names, descriptions) is escaped for the format,
   so that nothing in a scene runs as code of that format.
4. An expression that cannot be printed exactly is refused with
   :class:`~lagrange_cli.errors.InternalError`, never approximated.
5. ``options`` passed to ``run`` holds every declared option with a valid
   value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.naming import file_stem
from lagrange_cli.errors import InputError, Mark, Problem, nearest, placed

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

OptionValue: TypeAlias = str | bool

#: The parts of a document, in their order.
SECTIONS = (
    "system",
    "sketch",
    "account",
    "constraints",
    "energies",
    "equations",
    "result",
    "forces",
    "conserved",
    "initial",
    "certificate",
)

#: Those that a document has if nothing else is asked for.
DEFAULT_SECTIONS = tuple(s for s in SECTIONS if s not in ("sketch", "result", "initial"))


@dataclass(frozen=True, slots=True)
class Option:
    """An option of a format.

    Attributes
    ----------
    name
        Name of the option, without dashes.
    help
        Text for help pages.
    choices
        Values that it takes; none if it is a flag.
    default
        One of the choices; False for a flag.
    further
        A flag that asks for further functions: ``--with NAME``.
    """

    name: str
    help: str
    choices: tuple[str, ...] = ()
    default: OptionValue = False
    further: bool = False

    @property
    def is_flag(self) -> bool:
        return not self.choices

    def accepts(self, value: OptionValue) -> bool:
        return isinstance(value, bool) if self.is_flag else value in self.choices


@dataclass(frozen=True, slots=True)
class Emitter:
    """An output format.

    Attributes
    ----------
    name
        Name of the format, as ``--to`` takes it.
    title
        Its description in a few words.
    extensions
        Those of the files it writes, in order, with the dot.
    single_file
        True if it writes just one file, which can go to the terminal.
    run
        Turns equations and complete options into file name → text.
    options
        Its options.
    reserved
        Names that its files cannot have, since they would hide others.
    shows_steps
        True if it writes the steps of equations that have them.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    single_file: bool
    run: Callable[[Equations, Mapping[str, OptionValue]], dict[str, str]]
    options: tuple[Option, ...] = ()
    reserved: frozenset[str] = frozenset()
    shows_steps: bool = False

    def emit(
        self, equations: Equations, options: Mapping[str, OptionValue] | None = None
    ) -> dict[str, str]:
        """Return file name → text.

        Parameters
        ----------
        equations
            Equations of a derivation.
        options
            Values of the format's options; those absent take their defaults.

        Raises
        ------
        InputError
            An option that the format does not have, or a value it does not take; at the scene's
            place, equations that the format cannot hold.
        """
        complete = self._complete(options or {})
        try:
            return self.run(equations, complete)
        except InputError as refusal:
            raise placed(refusal, Mark(equations.file, 1, 1)) from refusal

    def files(self, name: str) -> tuple[str, ...]:
        """Return the names of the files for a system of this name, in order."""
        stem = file_stem(name, self.reserved)
        return tuple(stem + extension for extension in self.extensions)

    def renamed(self, name: str) -> list[str]:
        """Return a remark if the files for a system of this name cannot have that name."""
        plain = file_stem(name)
        if file_stem(name, self.reserved) == plain:
            return []
        wanted = " and ".join(plain + extension for extension in self.extensions)
        named = " and ".join(self.files(name))
        return [f"named {named}: {wanted} would hide what Python or C has under that name"]

    def _complete(self, chosen: Mapping[str, OptionValue]) -> dict[str, OptionValue]:
        """Check the given options and add the defaults of the others."""
        known = {option.name: option for option in self.options}
        for name in sorted(chosen):
            if name not in known:
                raise unknown_choice(
                    f"format '{self.name}' has no option '{name}'", name, list(known)
                )
            if not known[name].accepts(chosen[name]):
                choices = list(known[name].choices)
                expected = ", ".join(choices) if choices else "true or false"
                raise unknown_choice(
                    f"option '{name}' of format '{self.name}' cannot be '{chosen[name]}'; "
                    f"it takes {expected}",
                    str(chosen[name]),
                    choices,
                )
        return {name: chosen.get(name, option.default) for name, option in known.items()}


def unknown_choice(message: str, choice: str, candidates: list[str]) -> InputError:
    return InputError(Problem(message, hint=nearest(choice, candidates), rule="usage"))
