# The verbs of CONTRIBUTING.md; `just` lists them.

python := ".venv/bin/python"
bin := ".venv/bin"

# List the verbs.
default:
    @just --list

# Make the virtual environment with all that tests and linters need.
setup:
    python3 -m venv .venv
    {{bin}}/pip install --quiet -e '.[test,dev]'

# The tests of about a minute, which touch every part.
fast *options:
    {{python}} -m pytest -m "not slow" -n 2 --dist loadfile {{options}}

# All tests.
test *options:
    {{python}} -m pytest -n auto --dist loadfile {{options}}

# All tests, on all scenes where the suite runs a slice of them.
campaigns *options:
    {{python}} -m pytest -n auto --dist loadfile --campaigns {{options}}

# Style.
lint:
    {{bin}}/ruff check .
    {{bin}}/ruff format --check .

# Types.
types:
    {{bin}}/mypy

# The layers of imports.
layers:
    {{bin}}/lint-imports

# Every shipped scene against what it expects.
gallery:
    {{bin}}/lagrange check -j 2 systems

# The site with the pages of docs/ and of all scenes, or of those named, into out/site.
site *options:
    {{python}} docs/site/build.py out/site {{options}}

# Write the expected outputs and messages anew.
goldens:
    {{python}} -m pytest tests/goldens tests/errors tests/report/test_formats.py --update-goldens

# Write what the commands of README.md and of the pages of docs/ print.
readme:
    {{python}} -m tests.test_readme

# Compare all outputs with those of another commit.
same-output commit *options:
    {{python}} benchmarks/same_output.py {{commit}} {{options}}

# What continuous integration does, on a copy of the checkout.
ci:
    .ci/run
