"""A scene that is watched: its page on the loopback, loaded anew when it is saved."""

from __future__ import annotations

import http.client
import json
import shutil
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from lagrange_cli.pages.server import PageServer, message_page
from tests.pages.test_page import BROWSER, ROOT, SYSTEMS

PENDULUM = SYSTEMS / "pendulums" / "pendulum.yaml"


@pytest.fixture
def server() -> Iterator[PageServer]:
    with PageServer() as serving:
        serving.show(message_page("<script>first</script>"))
        yield serving


def answered(
    server: PageServer, path: str = "/page", method: str = "GET", **headers: str
) -> tuple[int, str]:
    host, _, port = server.address.removeprefix("http://").rstrip("/").partition(":")
    connection = http.client.HTTPConnection(host, int(port), timeout=10)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, headers=named)
    response = connection.getresponse()
    return response.status, response.read().decode()


def test_a_page_is_served_with_its_text_escaped(server: PageServer) -> None:
    assert server.address.startswith("http://127.0.0.1:")
    status, text = answered(server)
    assert status == 200
    assert "&lt;script&gt;first" in text
    assert "<script>" not in text
    version = answered(server, "/version")
    assert version == answered(server, "/version")
    server.show(message_page("second"))
    assert version != answered(server, "/version")
    assert "second" in answered(server)[1]
    assert "<iframe" in answered(server, "/")[1]


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "rebound.example"},
        {"Host": "rebound.example:80"},
        {"Host": "127.0.0.1"},
        {"Origin": "https://elsewhere.example"},
        {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_no_other_origin_is_answered(server: PageServer, headers: dict[str, str]) -> None:
    for path in ("/", "/page", "/version"):
        assert answered(server, path, **headers) == (403, "")


def test_nothing_else_is_served(server: PageServer) -> None:
    for path in ("/../../etc/passwd", "/page.html", "/pyproject.toml"):
        assert answered(server, path) == (404, "")
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE"):
        assert answered(server, method=method)[0] == 501


def test_requests_that_are_too_long_or_broken_off_harm_nothing(server: PageServer, capfd) -> None:
    host, _, port = server.address.removeprefix("http://").rstrip("/").partition(":")
    for request in (
        b"GET /" + b"a" * 100_000,
        b"GET / HTTP/1.0\r\nX: " + b"y" * 100_000,
        b"\xff\x00",
    ):
        with socket.create_connection((host, int(port)), timeout=10) as client:
            # The connection is reset instead of closed, with the answer unread.
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.sendall(request + b"\r\n\r\n")
    assert answered(server)[0] == 200
    assert capfd.readouterr().err == ""


def test_options_that_do_nothing_are_refused(tmp_path: Path) -> None:
    for words in (["-", "--watch"], [str(PENDULUM), "--watch", "-o", "a.html"]):
        done = subprocess.run(
            [sys.executable, "-m", "lagrange_cli", "show", *words], capture_output=True, text=True
        )
        assert done.returncode == 2
        assert "--watch" in done.stderr


@pytest.mark.slow
def test_a_browser_follows_the_scene(tmp_path: Path) -> None:
    node = shutil.which("node")
    if BROWSER is None or node is None or not (ROOT / "node_modules/puppeteer-core").is_dir():
        pytest.skip("no chromium, or no puppeteer-core (npm install --no-save puppeteer-core)")
    scene = tmp_path / "pendulum.yaml"
    right = PENDULUM.read_text(encoding="utf-8")
    scene.write_text(right, encoding="utf-8")
    words = [sys.executable, "-m", "lagrange_cli", "show", str(scene), "--watch", "-q"]
    shown = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert shown.stdout is not None
    address = shown.stdout.readline().strip()
    script = str(Path(__file__).with_name("watch.mjs"))
    browser = subprocess.Popen(
        [node, script, BROWSER, address],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert browser.stdin is not None
    assert browser.stdout is not None

    def sees(text: str) -> None:
        print(text, file=browser.stdin, flush=True)
        told = json.loads(browser.stdout.readline())
        assert told == {"wanted": text, "found": True, "messages": []}

    try:
        sees("Simple pendulum")
        scene.write_text(right.replace("theta)", "thta)", 1), encoding="utf-8")
        sees("pendulum.yaml:")
        scene.write_text(right.replace("Simple pendulum", "Another title"), encoding="utf-8")
        sees("Another title")
    finally:
        browser.stdin.close()
        browser.wait(30)
        shown.send_signal(signal.SIGINT)
        assert shown.wait(30) == 130
