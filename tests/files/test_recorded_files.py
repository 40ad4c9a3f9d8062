"""CSV files of recordings: what is read, and what is refused at its place."""

from __future__ import annotations

import os

import pytest

from lagrange_cli.errors import InputError, Mark, render
from lagrange_cli.files import MAX_BYTES, Recording, read_recording

AT = Mark("scene.yaml", 2, 20, "inputs: {a: {file: a.csv, column: a}}", 5)
COLUMN = Mark("scene.yaml", 2, 35, "inputs: {a: {file: a.csv, column: a}}", 1)


def recording(folder, column="a", interpolation="linear", file="a.csv"):
    return Recording(file, str(folder), column, AT, COLUMN, interpolation)


def read(folder, content, **given):
    (folder / "a.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(recording(folder, **given))


@pytest.mark.parametrize(
    "content",
    [
        "t,a\n0,1\n0.5,-2.5e0\n1,3\n",
        "t,a\r\n0,1\r\n0.5,-2.5\r\n1,3\r\n",
        "t,a\r0,1\r0.5,-2.5\r1,3",
        "\ufefft,a\n0,1\n0.5,-2.5\n1,3",
        'b,"a",t\n\n7,"1",0\n,-2.5,"0.5"\nx,+3.,1\n\n',
        " t , a \n 0 , 1 \n .5 , -2.5 \n 1 , 3 \n",
        'a,t,"more, with ""words"""\n1,0,é\n-2.5,0.5,\n3,1,"two\nlines"\n',
    ],
)
def test_what_is_read(tmp_path, content):
    found = read(tmp_path, content)
    assert found.times == (0.0, 0.5, 1.0)
    assert found.values == (1.0, -2.5, 3.0)


def test_numbers_are_the_nearest_doubles(tmp_path):
    found = read(tmp_path, "t,a\n0,0.1\n1e-320,1.7976931348623157e308\n")
    assert found.values == (0.1, 1.7976931348623157e308)
    assert found.times == (0.0, 1e-320)


@pytest.mark.parametrize(
    ("content", "place", "message", "hint"),
    [
        ("", (1, 1), "this file is empty", "its first row is t,a"),
        ("\n \n", (1, 1), "this file is empty", ""),
        ("t,a\n", (1, 1), "0 rows of numbers: interpolation 'linear' needs 2", ""),
        ("t,a\n0,1\n", (2, 1), "1 row of numbers: interpolation 'linear' needs 2", ""),
        ("t;a\n0;1\n1;2\n", (1, 1), "not separated by commas", "decimals have a point: t,a"),
        ("t\ta\n0\t1\n", (1, 1), "not separated by commas", ""),
        ("time,a\n0,1\n1,2\n", (1, 1), "no column is named 't'", "columns are 'time', 'a'"),
        ("0,1\n1,2\n", (1, 1), "no column is named 't'", "a first row names them"),
        ("t,a,t\n0,1,2\n", (1, 5), "two columns are named 't'", ""),
        ("t,a, a\n0,1,2\n", (1, 6), "two columns are named 'a'", ""),
        ("t,a\n0,1\n1\n", (3, 1), "1 cell in this row, 2 in the first one", "with a point"),
        ("t,a\n0,0,5\n1,2\n", (2, 1), "3 cells in this row, 2 in the first one", "a point"),
        ('t,a\n0,"0,5"\n', (2, 3), "expected a finite number, found '0,5'", "a point: 0.5"),
        ("t,a\n0,one\n", (2, 3), "expected a finite number, found 'one'", ""),
        ("t,a\n0,\n", (2, 3), "expected a finite number, found nothing", ""),
        ("t,a\n0,  nan\n", (2, 5), "expected a finite number, found 'nan'", "leave out rows"),
        ("t,a\n-inf,0\n", (2, 1), "expected a finite number, found '-inf'", "leave out rows"),
        ("t,a\n0,1_000\n", (2, 3), "expected a finite number, found '1_000'", ""),
        ("t,a\n0,٣\n", (2, 3), "expected a finite number, found '٣'", ""),
        ("t,a\n0,0x10\n", (2, 3), "expected a finite number, found '0x10'", ""),
        ("t,a\n0,1d3\n", (2, 3), "expected a finite number, found '1d3'", ""),
        ("t,a\n0,1e309\n", (2, 3), "'1e309' is beyond the range of doubles", ""),
        ("t,a\n0,1\n0.5,1\n0.25,2\n", (4, 1), "time 0.25 is not after the one before, 0.5", ""),
        (
            "t,a\n0,1\n0.0,1\n",
            (3, 1),
            "time 0.0 is not after the one before, 0.0",
            "each time once",
        ),
        ('b,t,a\n"x,y",3,1\n"x,y",1,1\n', (3, 7), "time 1 is not after", ""),
        ('t,a\n0,"1\n', (2, 1), "this row cannot be read", "quotation marks"),
        ('t,a\n0,"1"x\n', (2, 1), "this row cannot be read", "quotation marks"),
        (b"t,a\n0,\xb5\n", (2, 3), "byte 0xb5 is not part of a text in UTF-8", "save the file"),
        (b"t,gr\xf6\xdfe\n0,1\n", (1, 5), "byte 0xf6 is not part of a text in UTF-8", ""),
        (b"\x89PNG\r\n\x1a\n\x00\x00", (3, 1), "this is no text: it holds a zero byte", ""),
        (b"\xff\xfet\x00,\x00a\x00", (1, 1), "this is no text: it holds a zero byte", ""),
    ],
)
def test_what_is_refused_in_the_file(tmp_path, content, place, message, hint):
    with pytest.raises(InputError) as refused:
        read(tmp_path, content)
    (problem,) = refused.value.problems
    assert message in problem.message
    assert hint in problem.hint
    assert problem.mark is not None
    assert problem.mark.file == os.path.join(str(tmp_path), "a.csv")
    assert (problem.mark.line, problem.mark.column) == place
    assert render(problem)


@pytest.mark.parametrize(
    ("column", "hint"),
    [
        ("acc", "did you mean 'acc_x'?"),
        ("zzz", "columns are 't', 'acc_x', 'speed'"),
        ("", "columns"),
    ],
)
def test_a_missing_column_is_reported_in_the_scene(tmp_path, column, hint):
    with pytest.raises(InputError) as refused:
        read(tmp_path, "t,acc_x,speed\n0,1,2\n1,2,3\n", column=column)
    (problem,) = refused.value.problems
    assert problem.mark == COLUMN
    assert f"has no column '{column}'" in problem.message
    assert problem.hint.startswith(hint)


def refused_in_the_scene(of):
    with pytest.raises(InputError) as refused:
        read_recording(of)
    (problem,) = refused.value.problems
    assert problem.mark == AT
    return problem.message


def test_what_is_no_file_is_reported_in_the_scene(tmp_path):
    (tmp_path / "folder").mkdir()
    assert refused_in_the_scene(recording(tmp_path)) == "no such file"
    folder = refused_in_the_scene(recording(tmp_path, file="folder"))
    assert folder == "this is a folder, not a recording"
    assert "name of a file" in refused_in_the_scene(recording(tmp_path, file="a\0b"))
    os.mkfifo(tmp_path / "pipe")
    assert refused_in_the_scene(recording(tmp_path, file="pipe")) == "this is not a regular file"
    (tmp_path / "a.csv").write_bytes(b"t,a\n" + b"0" * MAX_BYTES)
    assert refused_in_the_scene(recording(tmp_path)) == "larger than 4 MiB"


@pytest.mark.parametrize("file", ["../a.csv", "sub/../../a.csv", "out/a.csv", "link.csv"])
def test_files_outside_the_folder_are_refused(tmp_path, file):
    inside = tmp_path / "scenes"
    (inside / "sub").mkdir(parents=True)
    (tmp_path / "a.csv").write_text("t,a\n0,1\n1,2\n")
    (inside / "out").symlink_to(tmp_path)
    (inside / "link.csv").symlink_to("../a.csv")
    message = refused_in_the_scene(recording(inside, file=file))
    assert message == f"'{file}' lies outside the folder of the scene"


@pytest.mark.parametrize("file", ["sub/b.csv", "sub/../sub/b.csv", "link.csv", "./sub//b.csv"])
def test_files_in_folders_below_are_read(tmp_path, file):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b.csv").write_text("t,a\n0,1\n1,2\n")
    (tmp_path / "link.csv").symlink_to("sub/b.csv")
    assert read_recording(recording(tmp_path, file=file)).values == (1.0, 2.0)


def test_a_scene_from_standard_input_has_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("t,a\n0,1\n1,2\n")
    assert read_recording(recording("")).times == (0.0, 1.0)
    assert "outside" in refused_in_the_scene(recording("", file="../a.csv"))


@pytest.mark.parametrize("rows", [0, 1])
def test_one_row_is_enough_to_hold(tmp_path, rows):
    content = "t,a\n" + "0,5\n" * rows
    if rows:
        assert read(tmp_path, content, interpolation="previous").values == (5.0,)
        return
    with pytest.raises(InputError, match="needs 1"):
        read(tmp_path, content, interpolation="previous")


@pytest.mark.slow
def test_a_large_file_is_read(tmp_path):
    lines = [f"{k},{k % 7}" for k in range(300_000)]
    content = "\n".join(["t,a", *lines])
    assert len(content) < MAX_BYTES
    found = read(tmp_path, content)
    assert len(found.times) == 300_000
    assert found.values[-1] == 299_999 % 7


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["x", '"x"', '"', "a,"])
def test_very_long_lines_are_refused_at_once(tmp_path, cell):
    with pytest.raises(InputError) as refused:
        read(tmp_path, "t,a\n" + f"{cell}," * 500_000)
    assert refused.value.problems[0].mark is not None
    with pytest.raises(InputError):
        read(tmp_path, f"{cell}," * 500_000)
