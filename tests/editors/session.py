"""An editor's side of the language server protocol, over the streams of a process."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

#: The language server for scenes.
SERVER = (sys.executable, "-m", "lagrange_cli", "lsp")

#: Seconds after which a server that says nothing is hanging.
PATIENCE = 120


class Session:
    """A server with one document, whose text an editor changes."""

    def __init__(
        self, folder: Path, name: str = "scene.yaml", command: Sequence[str] = SERVER
    ) -> None:
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=folder,
        )
        self.uri = (folder / name).as_uri()
        self.text, self.version, self.numbers = "", 0, 0
        self.messages: queue.Queue[dict[str, Any]] = queue.Queue()
        self.others: list[dict[str, Any]] = []
        threading.Thread(target=self._listen, daemon=True).start()
        answer = self.ask("initialize", processId=None, rootUri=None, capabilities={})
        self.capabilities = answer["capabilities"]
        self.tell("initialized")

    def _listen(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while header := stream.readline():
            length = int(header.split(b":")[1])
            while stream.readline().strip():
                pass
            self.messages.put(json.loads(stream.read(length)))

    def _send(self, **message: Any) -> None:
        data = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self.process.stdin.flush()

    def tell(self, method: str, **params: Any) -> None:
        """Send a notification."""
        self._send(method=method, params=params)

    def ask(self, method: str, **params: Any) -> Any:
        """Send a request; return its result, or the error of one that failed."""
        self.numbers += 1
        self._send(id=self.numbers, method=method, params=params)
        message = self.await_message(lambda m: m.get("id") == self.numbers and "method" not in m)
        return message["error"] if "error" in message else message["result"]

    def await_message(self, fits: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Wait for a message; others are left for later."""
        for number, message in enumerate(self.others):
            if fits(message):
                return self.others.pop(number)
        while not fits(message := self.messages.get(timeout=PATIENCE)):
            self.others.append(message)
        return message

    def open(self, text: str) -> None:
        self.text = text
        document = {"uri": self.uri, "languageId": "yaml", "version": 0, "text": text}
        self.tell("textDocument/didOpen", textDocument=document)

    def replace(self, old: str, new: str) -> None:
        """Change a part of the text that stands in it once, as an editor says it."""
        start = self.text.index(old)
        self.text = self.text[:start] + new + self.text[start + len(old) :]
        self.version += 1
        document = {"uri": self.uri, "version": self.version}
        changes = [{"text": self.text}]
        self.tell("textDocument/didChange", textDocument=document, contentChanges=changes)

    def at(self, offset: int) -> dict[str, int]:
        """The position of an offset, in units of UTF-16."""
        before = self.text[:offset]
        column = len(before.rpartition("\n")[2].encode("utf-16-le")) // 2
        return {"line": before.count("\n"), "character": column}

    def about(self, method: str, before: str, **params: Any) -> Any:
        """Ask about the place behind the first occurrence of a text."""
        position = self.at(self.text.index(before) + len(before))
        return self.ask(
            f"textDocument/{method}", textDocument={"uri": self.uri}, position=position, **params
        )

    def problems(self) -> list[dict[str, Any]]:
        """The problems of the present version, when they come next."""
        message = self.await_message(
            lambda m: (
                m.get("method") == "textDocument/publishDiagnostics"
                and m["params"].get("version", self.version) == self.version
            )
        )
        found: list[dict[str, Any]] = message["params"]["diagnostics"]
        return found

    def marked(self, place: dict[str, Any]) -> str:
        """The text in a range of one line."""
        line = self.text.splitlines()[place["start"]["line"]].encode("utf-16-le")
        assert place["start"]["line"] == place["end"]["line"]
        start, end = (2 * place[end]["character"] for end in ("start", "end"))
        return line[start:end].decode("utf-16-le")

    def applied(self, edits: list[dict[str, Any]]) -> str:
        """The text after some edits of places within lines."""
        lines = self.text.split("\n")
        for edit in sorted(edits, key=lambda e: e["range"]["start"]["character"], reverse=True):
            place, number = edit["range"], edit["range"]["start"]["line"]
            line = lines[number].encode("utf-16-le")
            start, end = (2 * place[end]["character"] for end in ("start", "end"))
            lines[number] = (
                line[:start] + edit["newText"].encode("utf-16-le") + line[end:]
            ).decode("utf-16-le")
        return "\n".join(lines)

    def leave(self) -> int:
        """End the session; the exit code of the server."""
        self.ask("shutdown")
        self.tell("exit")
        assert self.process.stdin is not None
        self.process.stdin.close()
        return self.process.wait(PATIENCE)
