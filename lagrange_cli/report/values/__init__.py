"""Reports as JSON values, with their schemas.

Results of the rooms below go in, dictionaries that JSON can hold come out; expressions are in the
scene language. Each report is a table of keys: name, type, a sentence, and where the value comes
from; what ``--json`` writes, its JSON Schema and the tables of docs/json.md come from it. Read
:mod:`.json_types` first, then :mod:`.check`, a small one; :mod:`.reports` lists all.
"""
