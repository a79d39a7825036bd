"""Code of the methods of dataclasses, which Python compiles anew at each start: kept on the disk.

A command imports some 300 dataclasses of six methods each. To compile their texts is a seventh of
the warm start of a small scene, and to read the code a fiftieth.
"""

from __future__ import annotations

import atexit
import builtins
import dataclasses
import marshal
import sys
from types import CodeType

from clpt.files import disk_cache


def keep() -> None:
    """Let dataclasses have the code of texts that a process before has compiled.

    It is that of `exec`: a text's code depends on nothing else.
    """
    if "exec" in vars(dataclasses):  # a process that calls commands one after another
        return
    entry = disk_cache.entry_of((__file__, dataclasses.__file__), [sys.version.encode()])
    stored = disk_cache.load(entry)
    known: dict[str, CodeType] = marshal.loads(stored[1]) if stored else {}
    before = len(known)

    def run(text: str, *scopes: dict[str, object]) -> None:
        code = known.get(text)
        if code is None:
            code = known[text] = compile(text, "<string>", "exec", dont_inherit=True)
        builtins.exec(code, *scopes)

    def store() -> None:
        if len(known) > before:
            disk_cache.store(entry, "code", marshal.dumps(known))

    dataclasses.exec = run  # type: ignore[attr-defined]
    atexit.register(store)
