"""A language server for scenes: problems as they are typed, names, hover texts, other names.

The text of a scene and a place in it go in; problems, completions, places and edits come out.
What a section holds is known from the JSON Schema, what a name stands for from the reader of
scenes, and words of an expression from its tokens. :mod:`.server` speaks with the editor and
leaves all work to processes that it may end, so that no text keeps it from answering;
:mod:`.answers` is what runs there. Read :mod:`.outline` first.

The protocol is that of https://microsoft.github.io/language-server-protocol, by pygls.
"""

__all__ = ["server"]
