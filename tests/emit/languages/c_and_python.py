"""C and Python, whose modules are called from Python."""

from __future__ import annotations

import ctypes
import types

import numpy as np

from tests.emit.emitted_c import Compiled
from tests.emit.languages.drivers import Driver


class Python(Driver):
    language = "python"
    holds_everything = True

    def build(self, folder, modules):
        raise NotImplementedError

    def script(self, module, words):
        raise NotImplementedError

    def results(self, folder, modules, calls):
        return [self._of(m, rows) for m, rows in zip(modules, calls, strict=True)]

    def _of(self, module, calls):
        emitted = types.ModuleType("emitted")
        exec(compile(module.files[0].read_text("utf-8"), "emitted", "exec"), emitted.__dict__)
        results = []
        for call in calls:
            more = [lambda t, y, p, u=call.u: np.array(u)] if call.u else []
            more = [] if call.function == "inputs" else more
            found = getattr(emitted, call.function)(
                call.t, np.array(call.y), emitted.Parameters(*call.p), *more
            )
            results.append([float(x) for x in np.ravel(found)])
        return results


class C(Python):
    language = "c"
    programs = ("gcc",)

    def _of(self, module, calls):
        compiled = Compiled(module.equations, module.folder)
        return [_called(compiled, module, call) for call in calls]


#: Functions that take the mode of contacts.
_OF_CONTACTS = ("rhs", "multipliers", "constraints")


def _called(compiled, module, call):
    """The results of a function; None if C has none of that name."""
    system = module.equations.system
    # T and V come before the energy function.
    before = 2 if call.function == "energy" else 0
    arrays = [np.array(a, float) for a in (call.y, call.u or (0.0,), call.p or (0.0,))]
    arrays += [np.zeros(compiled.macro("WORK")), np.full(before + len(call.expected) + 1, np.nan)]
    mode = np.zeros(len(system.contacts), np.intc)
    with_mode = bool(system.contacts) and call.function in _OF_CONTACTS
    order = [*arrays[:3], *([mode] if with_mode else []), *arrays[3:]]
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in order]
    entry = getattr(compiled.library, f"{compiled.prefix}_{call.function}", None)
    if entry is None:
        return None
    status = entry(ctypes.c_double(call.t), *pointers)
    return list(arrays[-1][before:-1]) if status == 0 else [np.nan] * len(call.expected)
