"""Build the site: the pages of docs/, and a page of every shipped scene, by mkdocs-material.

    python docs/site/build.py out/site [NAME ...]

With names only these scenes are built, and links to others are texts. Links and anchors are
checked: one that leads nowhere ends the build with a code other than 0.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml
from latex2mathml.converter import convert

from lagrange_cli.api import Derivation, load, open_cache
from lagrange_cli.errors import LagrangeError

ROOT = Path(__file__).parents[2]
DOCS, SYSTEMS = ROOT / "docs", ROOT / "systems"

#: Languages of code, by the format and the name that highlighters have for it.
_LANGUAGES = {
    "c": "c", "cpp": "cpp", "python": "python", "javascript": "javascript", "fortran": "fortran",
    "octave": "matlab", "rust": "rust",
}  # fmt: skip

#: Characters of a file of code beyond which a page has a link to it alone.
_MOST_SHOWN = 30_000

_NAV = (
    ("Gallery", "index.md"),
    ("Tutorial", "tutorial.md"),
    ("For lecturers", "lecturers.md"),
    ("The lecture", "lecture.md"),
    ("For engineers", "engineers.md"),
    ("All pages", "pages.md"),
)

_CONFIGURATION = {
    "site_name": "lagrange",
    "use_directory_urls": False,
    "theme": {"name": "material", "font": False, "features": ["content.code.copy"],
              "palette": [{"media": "(prefers-color-scheme: light)", "scheme": "default"},
                          {"media": "(prefers-color-scheme: dark)", "scheme": "slate"}]},
    "plugins": ["search"],
    "extra_css": ["site.css"],
    "markdown_extensions": ["tables", "toc", "md_in_html", "attr_list", "pymdownx.superfences",
                            {"pymdownx.tabbed": {"alternate_style": True}},
                            {"pymdownx.highlight": {"pygments_lang_class": True}}],
    "validation": {"omitted_files": "ignore", "anchors": "warn", "unrecognized_links": "warn"},
    "nav": [{title: page} for title, page in _NAV],
}  # fmt: skip

_STYLE = """\
mtd { padding: 0.3em 0; }
mtd[columnalign=right] { text-align: right; }
mtd[columnalign=left] { text-align: left; }
.gallery p { display: grid; gap: 1rem }
.gallery p { grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)) }
.gallery a { display: block; border: 1px solid #8884; border-radius: 4px }
.gallery a { padding: .5rem; text-align: center }
.gallery img, .film { height: 9rem; width: 100%; object-fit: contain; background: #fff }
.film { height: 18rem }
"""


@dataclass(frozen=True)
class _Page:
    """A scene on the site; ``film``: the file of its film, or of curves; empty without a start."""

    name: str
    title: str
    topic: str
    film: str


def main(arguments: Sequence[str]) -> int:
    """Build the site into a folder; return the exit code of mkdocs."""
    target, wanted = Path(arguments[0]).resolve(), set(arguments[1:])
    scenes = [
        path
        for path in sorted(SYSTEMS.rglob("*.yaml"))
        if path.parent.name != "refused" and (not wanted or path.stem in wanted)
    ]
    with TemporaryDirectory(prefix="lagrange-") as folder:
        source = Path(folder) / "source"
        _copy_pages(source, {path.stem for path in scenes})
        pages = [page for path in scenes if (page := _scene_page(path, source)) is not None]
        (source / "index.md").write_text("\n".join(_gallery(pages)), encoding="utf-8")
        (source / "lecture.md").write_text("\n".join(_lecture(pages)), encoding="utf-8")
        (source / "site.css").write_text(_STYLE, encoding="utf-8")
        configuration = {**_CONFIGURATION, "docs_dir": str(source), "site_dir": str(target)}
        file = Path(folder) / "mkdocs.yml"
        file.write_text(yaml.safe_dump(configuration, sort_keys=False), encoding="utf-8")
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", str(file)]
        environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
        return subprocess.run(command, check=False, env=environment).returncode


# -- the pages of docs/ -------------------------------------------------------------------


def _copy_pages(source: Path, built: set[str]) -> None:
    """Copy docs/, with links to scenes that lead to their pages, and without those beyond."""
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("site", "*.py", "__pycache__"))
    (source / "README.md").rename(source / "pages.md")
    for path in source.rglob("*.md"):
        up = "../" * (len(path.relative_to(source).parts) - 1)
        text = _with_formulas(path.read_text(encoding="utf-8"))
        path.write_text("\n".join(_linked(text, up, built)) + "\n", encoding="utf-8")


_FORMULA = re.compile(r"^\$\$\n(.*?)\n\$\$$|\$([^$\n]+)\$", re.MULTILINE | re.DOTALL)


def _with_formulas(text: str) -> str:
    """Write LaTeX between dollars as MathML, in documents; dollars of other pages are a shell's."""
    if "\n$$\n" not in text:
        return text

    def formula(match: re.Match[str]) -> str:
        displayed, inline = match.groups()
        if displayed:  # latex2mathml knows the same environment as align*
            return convert(displayed.replace("{aligned}", "{align*}"), display="block")
        # A line that began with <math> would be taken for a block of HTML.
        return f"<span>{convert(inline)}</span>"

    return _FORMULA.sub(formula, text)


_LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")


def _linked(text: str, up: str, built: set[str]) -> Iterator[str]:
    """Yield the lines of a page with links that lead somewhere; ``up``: the way to docs/."""

    def target(match: re.Match[str]) -> str:
        shown, link = match[1], match[2]
        place, _, anchor = link.partition("#")
        if "://" in link or not place:
            return match[0]
        if not place.startswith(f"{up}../"):
            page = f"{up}pages.md" if place == f"{up}README.md" else place
            return f"[{shown}]({page}{'#' if anchor else ''}{anchor})"
        name = Path(place).stem
        is_scene = "/systems/" in place and name in built
        return f"[{shown}]({up}scenes/{name}.md)" if is_scene else shown

    fence = False
    for line in text.splitlines():
        fence ^= line.startswith("```")
        yield line if fence else _LINK.sub(target, line)


# -- scenes -------------------------------------------------------------------------------


def _scene_page(path: Path, source: Path) -> _Page | None:
    """Write the page of a scene, and the files that it leads to."""
    folder = source / "scenes"
    folder.mkdir(exist_ok=True)
    cache = open_cache()
    derivation = load(path).derive(cache=cache)
    shown = derivation.equations.presentation
    title, film, moves = shown.title or shown.name, f"{path.stem}.film.svg", True
    try:
        trajectory = derivation.simulate(cache=cache)
        (folder / f"{path.stem}.motion.html").write_text(
            derivation.page(trajectory), encoding="utf-8"
        )
    except LagrangeError:
        trajectory, moves = None, False
    caption = "The system in motion"
    try:
        if trajectory is None:
            caption = "The system at its start"
            (folder / film).write_text(derivation.emit("svg").popitem()[1], encoding="utf-8")
        else:
            derivation.animate(folder / film, trajectory)
    except LagrangeError:
        # A scene that says of nothing where it is has curves.
        film, caption = f"{path.stem}.curves.svg", "Its coordinates over time"
        if trajectory is None:
            film = ""
        else:
            trajectory.plot(folder / film)
    shutil.copy(path, folder / path.name)
    lines = [
        f"# {escape(title)}", "", escape(shown.description or ""), "",
        *([f"![{caption}]({film}){{ .film }}", ""] if film else []),
        *([f'[The page on which it moves]({path.stem}.motion.html)', ""] if moves else []),
        "```console", f"$ lagrange derive {path.relative_to(ROOT)}",
        derivation.text().rstrip(), "```", "",
        "## Equations", "", _mathematics(derivation), "",
        "## Code", "", *_code(derivation, folder), "",
        "## Scene", "", "```yaml", path.read_text(encoding="utf-8").rstrip(), "```", "",
    ]  # fmt: skip
    (folder / f"{path.stem}.md").write_text("\n".join(lines), encoding="utf-8")
    return _Page(path.stem, title, path.parent.name, film)


def _mathematics(derivation: Derivation) -> str:
    """Return the derivation in HTML with MathML, as one block of Markdown."""
    html = derivation.show("account", "constraints", "energies", "equations", "conserved")
    text = str(html._repr_html_())
    # The page has the title and the description above.
    sections = re.sub(r"<h1>.*?(?=<section)", "", text, flags=re.DOTALL)
    body = re.sub(r"<h2>(.*?)</h2>", r"<h3>\1</h3>", sections, flags=re.DOTALL)
    return '<div markdown="0">' + re.sub(r"\n\s*\n", "\n", body) + "</div>"


def _code(derivation: Derivation, folder: Path) -> Iterator[str]:
    """Yield a tab of each language, with its files."""
    for language, highlighter in _LANGUAGES.items():
        try:
            files = derivation.emit(language)
        except LagrangeError:
            continue
        yield f'=== "{language}"'
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
            yield from ("", f"    [{name}]({name})", "")
            if len(text) <= _MOST_SHOWN:
                block = (f"```{highlighter}", *text.rstrip().splitlines(), "```")
                yield from (f"    {line}".rstrip() for line in block)
        yield ""


# -- gallery and lecture ------------------------------------------------------------------


def _gallery(pages: Sequence[_Page]) -> Iterator[str]:
    yield "# lagrange"
    yield ""
    yield "From a scene in YAML to certified equations of motion, code and motions."
    for topic in dict.fromkeys(page.topic for page in pages):
        yield from ("", f"## {topic.capitalize()}", "", '<div class="gallery" markdown>', "")
        for page in pages:
            if page.topic == topic:
                picture = f"![](scenes/{page.film})<br>" if page.film else ""
                yield f"[{picture}{escape(page.title)}](scenes/{page.name}.md)"
        yield from ("", "</div>")


def _lecture(pages: Sequence[_Page]) -> Iterator[str]:
    """Yield the systems of the lecture: the command, what it prints, and the page of each."""
    yield "# The systems of the lecture"
    for page in pages:
        if page.topic != "lecture":
            continue
        path = f"systems/lecture/{page.name}.yaml"
        text = load(ROOT / path).derive(cache=open_cache()).text().rstrip()
        yield from ("", f"## {escape(page.title)}", "")
        yield from ("```console", f"$ lagrange derive {path}", text, "```", "")
        yield f"[Its page: motion, equations, code](scenes/{page.name}.md)"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
