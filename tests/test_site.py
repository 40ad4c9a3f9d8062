"""The site: a slice of it is built, and every link on it leads somewhere."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
def test_a_slice_of_the_site_is_built(tmp_path: Path) -> None:
    if not all(map(importlib.util.find_spec, ("material", "latex2mathml"))):
        pytest.skip("mkdocs-material or latex2mathml is not installed (pip install '.[site]')")
    command = [sys.executable, str(ROOT / "docs/site/build.py"), str(tmp_path)]
    done = subprocess.run(
        [*command, "lever", "low_pass_filter"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    front = (tmp_path / "index.html").read_text(encoding="utf-8")
    page = (tmp_path / "scenes/lever.html").read_text(encoding="utf-8")
    assert 'href="scenes/lever.html"' in front
    assert 'src="scenes/lever.film.svg"' in front
    assert 'src="scenes/low_pass_filter.curves.svg"' in front
    assert (tmp_path / "scenes/low_pass_filter.curves.svg").exists()
    assert "<math" in page
    described = yaml.safe_load((ROOT / "systems/lecture/lever.yaml").read_text(encoding="utf-8"))
    equations = page.partition('id="equations"')[2].partition('id="code"')[0]
    assert described["description"].split(".")[0] not in equations
    assert "<h3></h3>" not in equations
    for name in ("lever.motion.html", "lever.c", "lever.py", "lever.mjs", "lever.rs"):
        assert f'href="{name}"' in page
        assert (tmp_path / "scenes" / name).exists()
    lecture = (tmp_path / "lecture.html").read_text(encoding="utf-8")
    assert 'href="scenes/lever.html"' in lecture
    steps = (tmp_path / "steps/bead_on_parabola.html").read_text(encoding="utf-8")
    assert "<math" in steps
    article = steps.partition("<article")[2].partition("</article>")[0]
    assert not re.search(r"[$\\]|&amp;|&#x00026;", article)
    for link in re.findall(r'href="([^"#:]+)"', front + page):
        assert any((tmp_path / folder / link).exists() for folder in (".", "scenes")), link
