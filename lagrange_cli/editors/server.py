"""The language server: what an editor sends and is sent, over standard streams, by pygls.

Problems of reading follow each change of a text; a while later the scene is derived, in another
process, which is ended when the text changes. Requests are answered by the first one. Processes
that take too long are ended, and started again when they are needed.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, BinaryIO

from lsprotocol import types
from pygls import uris
from pygls.lsp.server import LanguageServer
from pygls.workspace import TextDocument

from lagrange_cli.version import __version__

#: Seconds without a change after which a text is read, and after which it is derived.
_READ_AFTER, _DERIVED_AFTER = 0.05, 0.4
#: Seconds that reading, deriving, and an answer may take.
_READING, _DERIVING, _ANSWERING = 5.0, 30.0, 5.0

_KINDS = {
    "key": types.CompletionItemKind.Property,
    "value": types.CompletionItemKind.EnumMember,
    "name": types.CompletionItemKind.Variable,
    "function": types.CompletionItemKind.Function,
    "helper": types.CompletionItemKind.Struct,
    "unit": types.CompletionItemKind.Unit,
}

_SEVERITIES = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
}


#: Bytes of the longest answer.
_LONGEST = 2**26


class LateError(Exception):
    """An answer took too long, and its process was ended."""


class Helper:
    """A process of :mod:`.answers`, started when it is first asked, and again after its end."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._unread = 0

    async def ask(self, seconds: float, **request: Any) -> Any:
        """Return the answer to a request, which waits until those before it are answered.

        An answer that nobody waits for any more, since the request was cancelled, is passed over.

        Raises
        ------
        LateError
            There is none after some seconds; the process is ended.
        RuntimeError
            The request failed, or the process ended in the midst of it.
        """
        async with self._turn:
            try:
                reply = await asyncio.wait_for(self._exchange(request), seconds)
            except TimeoutError:
                await self.end()
                raise LateError from None
            except (OSError, ValueError) as error:
                await self.end()
                raise RuntimeError(f"the process ended: {error}") from None
        if "failure" in reply:
            raise RuntimeError(reply["failure"])
        return reply["answer"]

    async def _exchange(self, request: dict[str, Any]) -> dict[str, Any]:
        process = self._process or await self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(request).encode() + b"\n")
        self._unread += 1
        await process.stdin.drain()
        line = b""
        while self._unread:
            line = await process.stdout.readline()
            self._unread -= 1
        reply: dict[str, Any] = json.loads(line)
        return reply

    async def _started(self) -> asyncio.subprocess.Process:
        # -P: no module of the folder in which the editor runs takes the place of one of ours.
        self._unread = 0
        self._process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "lagrange_cli.editors.answers"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=_LONGEST,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        return self._process

    async def end(self) -> None:
        """End the process; the next request starts another one."""
        process, self._process = self._process, None
        if process is not None:
            with suppress(ProcessLookupError):
                process.kill()
            await process.wait()


@dataclass
class _Study:
    """Work on one version of a text, and its equations once they are derived."""

    text: str
    work: asyncio.Task[None] | None = None
    derived: dict[str, Any] | None = None


class SceneServer(LanguageServer):
    """A language server for scenes.

    Attributes
    ----------
    reader
        The process that reads all documents.
    derivers
        For each document the process that derives it.
    """

    def __init__(self) -> None:
        # Whole texts: editors and pygls do not agree on all characters that end a line.
        super().__init__("lagrange", __version__, types.TextDocumentSyncKind.Full)
        self.reader = Helper()
        self.derivers: dict[str, Helper] = {}
        self._studies: dict[str, _Study] = {}

    def study(self, uri: str) -> None:
        """Begin to read and derive the present text of a document; earlier work on it ends."""
        self.leave(uri)
        study = _Study(self.workspace.get_text_document(uri).source)
        self._studies[uri] = study
        study.work = asyncio.ensure_future(self._studied(uri, study))

    def leave(self, uri: str) -> None:
        """End the work on a document."""
        earlier = self._studies.pop(uri, None)
        if earlier is not None and earlier.work is not None:
            earlier.work.cancel()

    async def _studied(self, uri: str, study: _Study) -> None:
        await asyncio.sleep(_READ_AFTER)
        request = {"text": study.text, "file": file_of(uri)}
        try:
            problems = await self.reader.ask(_READING, ask="problems", **request)
        except LateError:
            problems = [_unread(f"the scene could not be read within {_READING:g} s")]
        except RuntimeError as error:
            problems = [_unread(f"the scene could not be read: {error}")]
        self._publish(uri, study, problems)
        if any(problem["severity"] == "error" for problem in problems):
            return
        await asyncio.sleep(_DERIVED_AFTER)
        deriver = self.derivers.setdefault(uri, Helper())
        try:
            study.derived = await deriver.ask(_DERIVING, ask="derived", **request)
        except (LateError, RuntimeError):
            return  # Long derivations, and reports of defects, are for the command line.
        except asyncio.CancelledError:
            await deriver.end()
            raise
        further = [p for p in study.derived["problems"] if p not in problems]
        self._publish(uri, study, problems + further)

    def _publish(self, uri: str, study: _Study, problems: list[dict[str, Any]]) -> None:
        document = self.workspace.get_text_document(uri)
        diagnostics = [
            types.Diagnostic(
                range=_range_in(document, problem["range"]),
                message=problem["message"],
                severity=_SEVERITIES[problem["severity"]],
                code=problem["rule"],
                source="lagrange",
            )
            for problem in problems
        ]
        self.text_document_publish_diagnostics(
            types.PublishDiagnosticsParams(uri, diagnostics, document.version)
        )

    def document(self, params: Any) -> TextDocument:
        """Return the document that a request is about."""
        return self.workspace.get_text_document(params.text_document.uri)

    def derived_of(self, document: TextDocument) -> dict[str, Any] | None:
        """Return what was derived of the present text of a document; None if nothing is."""
        study = self._studies.get(document.uri)
        is_present = study is not None and study.text == document.source
        return study.derived if study is not None and is_present else None

    async def answer(self, document: TextDocument, **request: Any) -> Any:
        """Ask the reader about the present text of a document; None if it takes too long."""
        file = file_of(document.uri)
        try:
            return await self.reader.ask(_ANSWERING, text=document.source, file=file, **request)
        except LateError:
            return None

    async def close(self, uri: str) -> None:
        """End all work on a document, and show no problems of it any more."""
        self.leave(uri)
        if uri in self.derivers:
            await self.derivers.pop(uri).end()
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    async def end(self) -> None:
        """End all work and its processes."""
        for uri in list(self._studies):
            self.leave(uri)
        for helper in (self.reader, *self.derivers.values()):
            await helper.end()


def file_of(uri: str) -> str:
    """Return the path of a document, which files beside it are looked for by."""
    return uris.to_fs_path(uri) or uri


def _unread(message: str) -> dict[str, Any]:
    place = {"line": 0, "start": 0, "end": 1}
    return {"range": place, "message": message, "rule": "limit", "severity": "warning"}


def _lines(document: TextDocument) -> list[str]:
    """Return the lines of a document as the protocol counts them."""
    return re.findall(r"[^\r\n]*(?:\r\n|[\r\n])|[^\r\n]+\Z", document.source)


def _range_in(document: TextDocument, place: dict[str, int]) -> types.Range:
    """Return a range in the units of the editor."""
    lines, codec = _lines(document), document.position_codec
    ends = (types.Position(place["line"], max(place[end], 0)) for end in ("start", "end"))
    start, end = (codec.position_to_client_units(lines, position) for position in ends)
    return types.Range(start, end)


def _place(document: TextDocument, position: types.Position) -> dict[str, int]:
    """Return a position of the editor as line and column, counted from 1."""
    place = document.position_codec.position_from_client_units(_lines(document), position)
    return {"line": place.line + 1, "column": place.character + 1}


def _offset(document: TextDocument, position: types.Position) -> int:
    """Return the number of characters before a position of the editor."""
    place = _place(document, position)
    before = _lines(document)[: place["line"] - 1]
    return sum(map(len, before)) + place["column"] - 1


def scene_server() -> SceneServer:
    """Make a server that knows what it is asked for."""
    server = SceneServer()

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        server.study(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        server.study(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        await server.close(params.text_document.uri)

    @server.feature(types.SHUTDOWN)
    async def left(params: None) -> None:
        await server.end()

    _tell_of_places(server)
    _edit(server)
    return server


def _tell_of_places(server: SceneServer) -> None:
    """Register the answers about a place."""

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION,
        types.CompletionOptions(trigger_characters=[" ", "{", "[", "_"]),
    )
    async def complete(params: types.CompletionParams) -> types.CompletionList:
        document = server.document(params)
        offset = _offset(document, params.position)
        candidates = await server.answer(document, ask="completions", offset=offset)
        items = [
            types.CompletionItem(
                label=candidate["label"],
                kind=_KINDS[candidate["kind"]],
                detail=candidate["detail"],
                insert_text=candidate["text"],
            )
            for candidate in candidates or ()
        ]
        return types.CompletionList(is_incomplete=False, items=items)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    async def hover(params: types.HoverParams) -> types.Hover | None:
        document = server.document(params)
        place, derived = _place(document, params.position), server.derived_of(document)
        about = await server.answer(document, ask="hover", derived=derived, **place)
        if about is None:
            return None
        content = types.MarkupContent(types.MarkupKind.Markdown, about["text"])
        return types.Hover(content, _range_in(document, about["range"]))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    async def definition(params: types.DefinitionParams) -> types.Location | None:
        document = server.document(params)
        place = _place(document, params.position)
        declared = await server.answer(document, ask="definition", **place)
        return declared and types.Location(document.uri, _range_in(document, declared))


def _edit(server: SceneServer) -> None:
    """Register the answers that change a text."""

    @server.feature(types.TEXT_DOCUMENT_RENAME)
    async def rename(params: types.RenameParams) -> types.WorkspaceEdit | None:
        document = server.document(params)
        place = _place(document, params.position)
        outcome = await server.answer(document, ask="renamed", name=params.new_name, **place)
        if outcome is None or "refusal" in outcome:
            message = "the scene could not be read" if outcome is None else outcome["refusal"]
            server.window_show_message(types.ShowMessageParams(types.MessageType.Error, message))
            return None
        edits = [
            types.TextEdit(_range_in(document, edit["range"]), edit["text"])
            for edit in outcome["edits"]
        ]
        return types.WorkspaceEdit(changes={document.uri: edits})

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    async def layout(params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
        document = server.document(params)
        text = await server.answer(document, ask="layout")
        if text is None:
            return None
        end = types.Position(len(_lines(document)) + 1, 0)
        return [types.TextEdit(types.Range(types.Position(0, 0), end), text)]


def serve(stream: BinaryIO) -> None:
    """Serve an editor over standard input and a stream that leads to it, until it leaves.

    Processes that work for an editor that is gone end with this one, whose pipes they read.
    """
    scene_server().start_io(stdout=stream)
