"""The versions of the image files of a scene.

Such a file may change while a scene is rendered: all samples show the version that was read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from clpt.errors import SceneError
from clpt.render.records.tables import version
from clpt.scene.fingerprint import file_digest


@dataclass(frozen=True)
class ImageFiles:
    """The versions of a scene's files, and the digests of their bytes, by path.

    They are noted before a scene is lowered; `check` compares them afterwards.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    digests: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, paths: Iterable[str], former: ImageFiles) -> ImageFiles:
        """Note files; former: the files of the scene before, which are not read again.

        Files that cannot be read are left out: lowering raises their errors.
        """
        versions: dict[str, str] = {}
        digests: dict[str, str] = {}
        for path in sorted(paths):
            versions[path] = version(path)
            if former.versions.get(path) == versions[path]:
                digests[path] = former.digests[path]
                continue
            try:
                digests[path] = file_digest(Path(path))
            except SceneError:
                del versions[path]
        return cls(versions, digests)

    def check(self) -> None:
        """Raise SceneError for a file that has changed since, perhaps while it was read."""
        for path, before in self.versions.items():
            if version(path) != before:
                raise SceneError("changed while the scene was read; try again", file=path)
