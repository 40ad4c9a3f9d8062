"""Shared by the tests of explanations: scenes, and what is suggested put in its place."""

from __future__ import annotations

import re

import yaml

from tests.cli.terminal import Done, lagrange

P = "particles: {p: {mass: 1, position: [x, y, z]}}\n"


def rods(lengths: dict[str, object], **bodies: str) -> str:
    lines = [f"  {name}: {{mass: 1}}" for name in sorted({c for name in lengths for c in name})]
    lines.append("constraints:")
    lines += [
        f"  {name}: {{distance: [{name[0]}, {name[1]}], equals: {length}}}"
        for name, length in lengths.items()
    ]
    return "particles:\n" + "\n".join(lines) + "\n"


def run(command: str, scene: str, *options: str) -> Done:
    return lagrange(command, "-", *options, input=scene)


def hints(done: Done) -> list[str]:
    """The lines below the last source line and its caret, or below a message without place."""
    lines = done.stderr.rstrip("\n").splitlines()
    carets = [k for k, line in enumerate(lines) if re.match(r" +\| +\^", line)]
    last = carets[-1] if carets else 0
    return [line.strip() for line in lines[last + 1 :] if line.startswith("   ")]


def pasted(scene: str, line: str) -> str:
    """The scene with a line in place of its section, or of its constraint, of that name."""
    tree, new = yaml.safe_load(scene), yaml.safe_load(line)
    for key, value in new.items():
        (tree["constraints"] if key in tree.get("constraints", {}) else tree)[key] = value
    return yaml.safe_dump(tree, sort_keys=False, width=1000)


def without(scene: str, constraint: str) -> str:
    tree = yaml.safe_load(scene)
    del tree["constraints"][constraint]
    return yaml.safe_dump(tree, sort_keys=False, width=1000)
