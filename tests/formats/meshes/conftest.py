"""What the tests of several mesh formats share."""

from __future__ import annotations

import pytest

from clpt.formats.meshes import mesh


@pytest.fixture
def read_as(tmp_path):
    """Read bytes or a text as a file of a suffix."""

    def of(suffix, content):
        path = tmp_path / f"a{suffix}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return mesh.read_mesh(path)

    return of
