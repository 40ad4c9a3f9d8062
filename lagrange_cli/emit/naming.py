"""Identifiers and comments of emitted code: scene text made harmless.

Scene names are ASCII identifiers or family members (``x[1]``); whatever
arrives here, what leaves is a valid identifier that clashes with no keyword,
no macro and no other name.
"""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate, Input, Parameter, State

_C_WORDS = """
alignas alignof and and_eq asm atomic_cancel atomic_commit atomic_noexcept auto bitand bitor
bool break case catch char char8_t char16_t char32_t class co_await co_return co_yield compl
concept const const_cast consteval constexpr constinit continue decltype default delete do
double dynamic_cast else enum explicit export extern false float for friend goto if import
inline int long module mutable namespace new noexcept not not_eq nullptr operator or or_eq
private protected public reflexpr register reinterpret_cast requires restrict return short
signed sizeof static static_assert static_cast struct switch synchronized template this
thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using
virtual void volatile wchar_t while xor xor_eq final override fortran
complex imaginary noreturn I NULL NAN INFINITY HUGE_VAL HUGE_VALF HUGE_VALL EOF BUFSIZ RAND_MAX
DOMAIN OVERFLOW UNDERFLOW SING PLOSS TLOSS MAXFLOAT X_TLOSS TMP_MAX FILENAME_MAX P_tmpdir
errno assert offsetof setjmp stdin stdout stderr signgam math_errhandling
isfinite isinf isnan isnormal signbit fpclassify isgreater isless isunordered
M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2
linux unix i386 sun vax mips near far huge small hyper interface pascal cdecl min max
IN OUT OPTIONAL TRUE FALSE ERROR CONST VOID DELETE PI TWO_PI DEG_TO_RAD RAD_TO_DEG F
"""

#: Keywords of C (to C23) and C++ (to C++23), and names that common headers
#: define as macros, which would break a structure field of that name.
C_RESERVED = frozenset(_C_WORDS.split())

#: Keywords of Python, and what a NamedTuple keeps for itself.
PYTHON_RESERVED = frozenset(keyword.kwlist) | {"count", "index"}

#: Names that a module must not have: that of a module which it imports, or which NumPy does, would
#: hide that one where the module is run as a script; a keyword cannot be imported.
PYTHON_MODULES = (
    frozenset(sys.stdlib_module_names)
    | frozenset(keyword.kwlist)
    | {"casadi", "jax", "numpy", "sitecustomize", "usercustomize"}
)

_OCTAVE_WORDS = """
break case catch classdef continue do else elseif elseif end end_try_catch end_unwind_protect
endclassdef endenumeration endevents endfor endfunction endif endmethods endparfor endproperties
endswitch endwhile enumeration events for function global if methods otherwise parfor persistent
properties return spmd switch try until unwind_protect unwind_protect_cleanup while
"""

#: Keywords of Octave and MATLAB.
OCTAVE_RESERVED = frozenset(_OCTAVE_WORDS.split())

_C_HEADERS = """
aio alloca assert byteswap complex cpio crypt ctype dirent dlfcn elf endian err errno
error execinfo fcntl features fenv float fmtmsg fnmatch ftw getopt glob grp iconv ieee754 inttypes
iso646 langinfo libgen limits link locale malloc math memory monetary mqueue ndbm netdb
nl_types paths poll printf pthread pty pwd quadmath regex sched search semaphore setjmp
shadow signal spawn stab stdalign stdarg stdatomic stdbit stdbool stdckdint stddef stdint stdio
stdlib stdnoreturn string strings stropts syscall sysexits syslog tar termios tgmath threads time
trace uchar ucontext ulimit unistd utime utmp utmpx values wait wchar wctype wordexp
"""

#: Headers of C and POSIX: one of that name in a folder that the compiler searches would hide them.
#: Those in folders, as <net/if.h>, are found nevertheless.
C_HEADERS = frozenset(_C_HEADERS.split())

#: Letters that tails of identifiers take where their length is limited.
_TAIL = 8

_SIGNS = {"[": "_", "]": "", ",": "_", " ": ""}


def identifier(name: str) -> str:
    """ASCII letters, digits and underscores for any name (``x[1]`` → ``x_1``)."""
    text = "".join(
        c if c.isascii() and (c.isalnum() or c == "_") else _SIGNS.get(c, f"_u{ord(c):04x}")
        for c in name
    )
    return text if text and not text[0].isdigit() else f"x_{text}"


def file_stem(name: str, reserved: frozenset[str] = frozenset()) -> str:
    """The name itself where it is a plain file name, else an identifier made of it; with a tail
    where it would be reserved, in capitals too: not every file system tells them apart."""
    plain = re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*", name)
    stem = name if plain else identifier(name)
    return f"{stem}_" if stem.lower() in reserved or stem in reserved else stem


def unique_identifiers(
    names: Iterable[str],
    reserved: frozenset[str],
    *,
    caseless: bool = False,
    longest: int | None = None,
) -> list[str]:
    """Return an identifier for each name, in order: reserved ones, ones that begin
    with an underscore and repeated ones get a tail of underscores and digits.

    Parameters
    ----------
    caseless
        Capitals do not tell identifiers from each other, nor from reserved words.
    longest
        Number of letters at most; None for any number.
    """
    if caseless:
        reserved = frozenset(word.lower() for word in reserved)
    taken: set[str] = set()
    result = []
    for name in names:
        base = identifier(name)
        if base.startswith("_"):
            base = f"x{base}"
        base = base[: longest and longest - _TAIL]
        if (base.lower() if caseless else base) in reserved:
            base += "_"
        choice, tail = base, 2
        while (choice.lower() if caseless else choice) in taken:
            choice, tail = f"{base}_{tail}", tail + 1
        taken.add(choice.lower() if caseless else choice)
        result.append(choice)
    return result


def comment_text(text: str) -> str:
    """One line of plain text that ends no comment and no string in C or Python.

    Control characters and line breaks become spaces; ``*/``, ``/*``, trigraphs
    and backslashes are broken up or replaced, and so are quotation marks in
    threes.
    """
    printable = "".join(c if c.isprintable() else " " for c in text)
    for unsafe, written in (
        ("\\", "/"),
        ("*/", "* /"),
        ("/*", "/ *"),
        ("??", "? ?"),
        ('"""', "'''"),
    ):
        while unsafe in printable:
            printable = printable.replace(unsafe, written)
    return " ".join(printable.split())


def domain_note(equations: Equations) -> list[str]:
    """Return a line that says what the scene declares positive; none where it declares nothing."""
    names = ", ".join(comment_text(name) for name, _ in equations.system.positive)
    return [f"All of this holds only where these are positive: {names}."] if names else []


def described(quantity: Coordinate | Parameter | State) -> str:
    """Name, unit and description, as far as there are any, as text of a comment."""
    text = comment_text(quantity.name)
    if quantity.unit:
        text += f" [{comment_text(quantity.unit)}]"
    if quantity.description:
        text += f": {comment_text(quantity.description)}"
    return text


def input_identifier(source: Input) -> str:
    """Name an input, or a rate of one, as velocities are named: ``l``, ``l_dot``, ``l_ddot``."""
    return source.base + ("", "_dot", "_ddot")[source.order]
