"""Names of scenes: where each stands, other names, what may stand at a place; and hostile texts."""

from __future__ import annotations

import random
from contextlib import suppress
from pathlib import Path

import pytest

from lagrange_cli.editors.answers import renamed
from lagrange_cli.editors.completion import completions
from lagrange_cli.editors.hovering import hover_text
from lagrange_cli.editors.outline import Outline, Symbol
from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene import read_text
from lagrange_cli.scene.reading.source import edited
from tests.systems.shipped import SCENES, sliced

LABELS = """\
particles:
  l: {mass: m, position: [x, 0, z]}
  far: {mass: m, position: [q, 0, 0]}
parameters: {m: 1, l: 2}
constraints:
  l: {distance: [l, far], equals: l}
  floor: z_l >= -l
potentials: {m: m*z_l}
forces: {x: {on: l, force: [-m, 0, 0]}}
expect:
  conserved: [p_x]
  events: [{name: "contact:floor"}]
  equations: ["m*ddot(x) = lambda_l"]
"""


def outline(text: str) -> Outline:
    return Outline.of_text(text, "scene.yaml")


def with_name(text: str, before: str, name: str) -> str:
    """The text after the name behind the first occurrence of ``before`` is another one."""
    line, column = place(text, text.index(before) + len(before))
    return edited(text, renamed(text, outline(text), line, column, name))


def place(text: str, offset: int) -> tuple[int, int]:
    before = text[:offset]
    return before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1


def test_a_name_of_several_things_is_told_apart() -> None:
    ball = with_name(LABELS, "{on: ", "ball")
    expected = LABELS.replace("  l: {mass", "  ball: {mass").replace("z_l", "z_ball")
    assert ball == expected.replace("[l, far]", "[ball, far]").replace("on: l", "on: ball")
    length = with_name(LABELS, "equals: ", "length")
    expected = LABELS.replace("l: 2", "length: 2").replace("equals: l", "equals: length")
    assert length == expected.replace(">= -l", ">= -length")
    rod = with_name(LABELS, "constraints:\n  ", "rod")
    assert rod == LABELS.replace("  l: {dist", "  rod: {dist").replace("lambda_l", "lambda_rod")
    ground = with_name(LABELS, "contact:", "ground")
    assert ground == LABELS.replace("floor", "ground")
    # A name that stands bare in a position, and its momentum.
    assert with_name(LABELS, "position: [", "along") == LABELS.replace(
        "[x, 0", "[along, 0"
    ).replace("p_x", "p_along").replace("ddot(x)", "ddot(along)")


@pytest.mark.parametrize("name", ["", "2x", "sin", "t", "far", "x_y z", "a" * 101])
def test_names_that_cannot_be_are_refused(name: str) -> None:
    with pytest.raises(InputError):
        with_name(LABELS, "{on: ", name)


def test_what_is_not_known_to_the_character_is_refused() -> None:
    text = LABELS.replace("m*z_l", '"m*z_l\\u0020"')
    with pytest.raises(InputError, match="write that on one line"):
        with_name(text, "{on: ", "ball")


@pytest.mark.slow
@sliced(SCENES)
def test_renaming_keeps_every_shipped_scene_valid(name: str) -> None:
    """An occurrence that is left out would be an unknown name."""
    path = Path(SCENES[name])
    text = path.read_text(encoding="utf-8")
    known = Outline.of_text(text, str(path))
    before = [o.symbol for o in known.occurrences]
    chosen = random.Random(name).sample(sorted(known.declarations), min(6, len(known.declarations)))
    for symbol in chosen:
        if not all(o.exact for o in known.occurrences if o.symbol == symbol):
            continue  # It stands in a text of several lines, and is refused.
        mark = place_of(known, symbol)
        edits = renamed(text, known, mark.line, mark.column, "another_name")
        after = edited(text, edits)
        read_text(after, str(path))
        again = Outline.of_text(after, str(path))
        renewed = Symbol(symbol.namespace, "another_name")
        assert [renewed if s == symbol else s for s in before] == [
            o.symbol for o in again.occurrences
        ]
        assert renamed_back(after, again, renewed, symbol.name) in (text, None)


def renamed_back(text: str, known: Outline, symbol: Symbol, name: str) -> str | None:
    """The text with a name that it had; None where another thing has this name."""
    mark = place_of(known, symbol)
    try:
        return edited(text, renamed(text, known, mark.line, mark.column, name))
    except InputError as refusal:
        if "stands in the scene already" not in str(refusal):
            raise
        return None


def place_of(known: Outline, symbol: Symbol) -> Mark:
    """A place where the name stands: positions of a body are declared at the body's name."""
    return next(o.mark for o in known.occurrences if o.symbol == symbol)


def test_every_key_of_the_schema_has_a_hover_text() -> None:
    text = "particles: {b: {mass: 1, position: [x, 0, 0]}}\nsimulate: {until: 1}\n"
    known = outline(text)
    found = {
        p.path[-1]: hover_text(known, p.scalar.mark.line, p.scalar.mark.column, None)
        for p in known.places
        if p.kind == "key"
    }
    assert found.keys() == {"particles", "mass", "position", "simulate", "until"}
    assert all(about is not None and ": " in about[0] for about in found.values())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_half_written_and_hostile_texts_have_an_answer(seed: int) -> None:
    draw = random.Random(seed)
    source = Path(draw.choice(list(SCENES.values()))).read_text(encoding="utf-8")
    hostile = [
        "{",
        "[",
        '"',
        ": ",
        "&a ",
        "*a",
        "- ",
        "\t",
        "\u2028",
        "!!x ",
        "#",
        "x[i=1..9999999]",
    ]
    for _ in range(40):
        text = source
        for _ in range(draw.randint(1, 3)):
            start = draw.randint(0, len(text))
            end = min(len(text), start + draw.randint(0, 30))
            text = text[:start] + draw.choice(["", *hostile]) + text[end:]
        offset = draw.randint(0, len(text))
        assert all(c["label"] for c in completions(text, offset, "scene.yaml"))
        try:
            known = outline(text)
        except InputError:
            continue
        hover_text(known, *place(text, offset), None)
        with suppress(InputError):
            assert renamed(text, known, *place(text, offset), "another_name")
