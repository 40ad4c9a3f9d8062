"""A server of one page on the loopback, which browsers load again when the page is another one.

It answers GET of three addresses under its own name alone: to a host of another name, as DNS
rebinding asks with, and to pages of other origins it says nothing. The page stands in a frame of
a shell, whose script asks for the page's version; the page itself keeps its own policy.
"""

from __future__ import annotations

import base64
import hashlib
import secrets
from html import escape
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from types import TracebackType

LOOPBACK = "127.0.0.1"


def policy_hash(text: str) -> str:
    """Return the source by which a Content-Security-Policy names a script or style."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


_SCRIPT = """\
const frame = document.querySelector("iframe");
let shown = null;
async function look() {
  try {
    const version = await (await fetch("/version", { cache: "no-store" })).text();
    if (shown !== null && shown !== version) frame.contentWindow.location.reload();
    shown = version;
    document.title = frame.contentDocument.title || "lagrange";
  } catch { document.title = "lagrange has ended"; }
}
setInterval(look, 500);
look();
"""

_STYLE = "html, body, iframe { margin: 0; border: 0; width: 100%; height: 100%; display: block }"

_SHELL = (
    '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>lagrange</title>'
    f'<style>{_STYLE}</style></head><body><iframe src="/page" title="the scene"></iframe>'
    f"<script>{_SCRIPT}</script></body></html>"
)

_SHELL_POLICY = (
    f"default-src 'none'; script-src {policy_hash(_SCRIPT)}; style-src {policy_hash(_STYLE)}; "
    "frame-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'"
)


def message_page(text: str) -> str:
    """Return a page that holds a text alone, as what is wrong with a scene."""
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>lagrange</title>'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'">'
        '<meta name="color-scheme" content="light dark"></head>'
        f'<body><pre role="alert">{escape(text)}</pre></body></html>'
    )


class PageServer:
    """A page, served while the context lasts.

    Attributes
    ----------
    address
        The address of the page.
    """

    def __init__(self, port: int = 0) -> None:
        self._server = _Server((LOOPBACK, port), _Handler)
        self.address = f"http://{LOOPBACK}:{self._server.server_port}/"

    def show(self, page: str) -> None:
        """Replace the page; browsers that show it load the other one."""
        self._server.shown = (secrets.token_hex(8), page.encode("utf-8"))

    def __enter__(self) -> PageServer:
        Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    """The server, with the version and the bytes of what it shows."""

    daemon_threads = True
    shown: tuple[str, bytes] = ("", b"")

    def handle_error(self, request: object, client_address: object) -> None:
        """Leave the terminal to the command: a client that goes away is nobody's error."""


class _Handler(BaseHTTPRequestHandler):
    """Answers GET of the shell, the page and its version."""

    server: _Server
    server_version, sys_version = "lagrange", ""
    #: Seconds after which a client that says nothing is left.
    timeout = 10

    def do_GET(self) -> None:
        version, page = self.server.shown
        answers = {
            "/": (_SHELL.encode("utf-8"), "text/html", _SHELL_POLICY),
            "/page": (page, "text/html", "frame-ancestors 'self'"),
            "/version": (version.encode("ascii"), "text/plain", "default-src 'none'"),
        }
        path = self.path.partition("?")[0]
        if not self._is_own():
            self._answer(HTTPStatus.FORBIDDEN, b"", "text/plain", "default-src 'none'")
        elif path in answers:
            self._answer(HTTPStatus.OK, *answers[path])
        else:
            self._answer(HTTPStatus.NOT_FOUND, b"", "text/plain", "default-src 'none'")

    def _is_own(self) -> bool:
        """Say whether a request is to this server by its name, and from no other origin."""
        hosts = {f"{name}:{self.server.server_port}" for name in (LOOPBACK, "localhost")}
        asked, origin = self.headers.get("Host"), self.headers.get("Origin")
        site = self.headers.get("Sec-Fetch-Site", "none")
        own_origin = origin is None or origin == f"http://{asked}"
        return asked in hosts and own_origin and site in ("none", "same-origin")

    def _answer(self, status: HTTPStatus, body: bytes, kind: str, policy: str) -> None:
        self.send_response(status)
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Content-Security-Policy", policy),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cache-Control", "no-store"),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Leave the terminal to the command."""
