"""The files that a scene's images are read from, as they were when they were read.

Such a file may change while a scene is rendered: samples are of what was read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from clpt.errors import SceneError
from clpt.render.analysis.lowering_cache import version
from clpt.scene import Scene
from clpt.scene.fingerprint import file_digest, named_files


@dataclass(frozen=True)
class ImageFiles:
    """What stands for the files of a scene by path: their versions and the digests of their bytes.

    They are noted before a scene is lowered; `check` says afterwards whether they are still so.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    digests: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene, former: ImageFiles) -> ImageFiles:
        """Note the files of a scene; former: of the scene before, whose files are not read again.

        Files that cannot be read are left out: whoever lowers the scene tells what is wrong.
        """
        versions: dict[str, str] = {}
        digests: dict[str, str] = {}
        for path in sorted(named_files(scene)):
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
