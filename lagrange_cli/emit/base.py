"""An output format and its options, and the contract that every format keeps.

The contract of a format:

1. ``emit`` is a pure function: the same equations and options give the same
   bytes, whatever the hash seed, the machine or the day.
2. It returns file names (no folders) with their text, those of
   :meth:`Emitter.files`: ``NAME.EXT`` with ``NAME`` = ``equations.name``,
   changed if it is ``reserved``, and ``EXT`` one of ``extensions``. It
   writes nothing itself. A format with compiled code returns the texts that
   its file holds, and ``pack`` makes this file of them: only there do bytes
   depend on the machine and its tools.
3. Text from a scene (titles, names, descriptions) is escaped for the format,
   so that nothing in a scene runs as code of that format.
4. An expression that cannot be printed exactly is refused with
   :class:`~lagrange_cli.errors.InternalError`, never approximated.
5. ``options`` passed to ``run`` holds every declared option with a valid
   value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.naming import file_stem
from lagrange_cli.errors import InputError, Mark, Problem, nearest, placed

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

OptionValue: TypeAlias = str | bool


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
    default_text
        The default as help pages say it, if not by its value.
    further
        A flag that asks for further functions: ``--with NAME``.
    metavar
        What stands for a value that is no single choice: several choices with commas between them,
        or a text that ``accepted`` lets pass.
    accepted
        Says whether a text is a value; None for choices and flags.
    refused
        Choice of other formats → why this one does not have it.
    """

    name: str
    help: str
    choices: tuple[str, ...] = ()
    default: OptionValue = False
    default_text: str = ""
    further: bool = False
    metavar: str = ""
    accepted: Callable[[str], bool] | None = None
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_flag(self) -> bool:
        return not self.choices and self.accepted is None

    @property
    def shown_default(self) -> OptionValue:
        """Return the default as help pages say it."""
        return self.default_text or self.default

    def wrong(self, value: OptionValue) -> str | None:
        """Return the part of a value that the option does not take, None if it takes all of it."""
        if self.is_flag or isinstance(value, bool):
            return None if self.is_flag and isinstance(value, bool) else str(value)
        if self.accepted is not None:
            return None if self.accepted(value) else value
        chosen = [part.strip() for part in value.split(",")] if self.metavar else [value]
        return next((part for part in chosen if part not in self.choices), None)

    def expected(self) -> str:
        """Return a phrase for the values that the option takes."""
        if self.accepted is not None:
            return self.metavar
        return ", ".join(self.choices) if self.choices else "true or false"


@dataclass(frozen=True, slots=True)
class Package:
    """Files of a format that holds more than text.

    Attributes
    ----------
    files
        File name → bytes.
    remarks
        What they lack for want of a tool on this machine.
    """

    files: Mapping[str, bytes]
    remarks: tuple[str, ...] = ()


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
        True if it writes just one file of text, which can go to the terminal.
    run
        Turns equations and complete options into file name → text.
    options
        Its options.
    reserved
        Names that its files cannot have, since they would hide others.
    shows_steps
        True if it writes the steps of equations that have them.
    pack
        Makes the one file of what ``run`` has written, by its name, if what ``run`` writes are
        not the files themselves; None if they are.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    single_file: bool
    run: Callable[[Equations, Mapping[str, OptionValue]], dict[str, str]]
    options: tuple[Option, ...] = ()
    reserved: frozenset[str] = frozenset()
    shows_steps: bool = False
    pack: Callable[[str, Mapping[str, str]], Package] | None = None

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
        complete = self.complete(options or {})
        try:
            return self.run(equations, complete)
        except InputError as refusal:
            raise placed(refusal, Mark(equations.presentation.file, 1, 1)) from refusal

    def files(self, name: str) -> tuple[str, ...]:
        """Return the names of the files for a system of this name, in order."""
        stem = file_stem(name, self.reserved)
        return tuple(stem + extension for extension in self.extensions)

    def package(self, name: str, texts: Mapping[str, str]) -> Package:
        """Return the files of a system of this name, of the texts that :meth:`emit` returned."""
        if self.pack is None:
            return Package({file: text.encode() for file, text in texts.items()})
        (file,) = self.files(name)
        return self.pack(file, texts)

    def renamed(self, name: str) -> list[str]:
        """Return a remark if the files for a system of this name cannot have that name."""
        plain = file_stem(name)
        if file_stem(name, self.reserved) == plain:
            return []
        wanted = " and ".join(plain + extension for extension in self.extensions)
        named = " and ".join(self.files(name))
        return [f"named {named}: {wanted} would hide what Python or C has under that name"]

    def complete(self, chosen: Mapping[str, OptionValue]) -> dict[str, OptionValue]:
        """Check the given options and add the defaults of the others."""
        return completed(self.name, self.options, chosen)


@dataclass(frozen=True, slots=True)
class FormatList:
    """Output formats by name, as a value that is reported."""

    emitters: Mapping[str, Emitter]


def completed(
    format_: str, options: tuple[Option, ...], chosen: Mapping[str, OptionValue]
) -> dict[str, OptionValue]:
    """Check values of the options of a format and add the defaults of the others.

    Raises
    ------
    InputError
        An option that the format does not have, or a value it does not take.
    """
    known = {option.name: option for option in options}
    for name in sorted(chosen):
        if name not in known:
            raise unknown_choice(f"format '{format_}' has no option '{name}'", name, list(known))
        option = known[name]
        wrong = option.wrong(chosen[name])
        if wrong is not None:
            why = option.refused.get(wrong, f"it takes {option.expected()}")
            message = f"option '{name}' of format '{format_}' cannot be '{wrong}'; {why}"
            raise unknown_choice(message, wrong, list(option.choices))
    return {name: chosen.get(name, option.default) for name, option in known.items()}


def unknown_choice(message: str, choice: str, candidates: list[str]) -> InputError:
    return InputError(Problem(message, hint=nearest(choice, candidates), rule="usage"))
