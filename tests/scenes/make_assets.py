"""Makes the images and meshes of the scenes beside it: `python tests/scenes/make_assets.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clpt import images

HERE = Path(__file__).resolve().parent


def tiles() -> np.ndarray:
    """Sixteen coloured tiles with a gradient, so that a flip in any direction shows."""
    y, x = np.mgrid[0:32, 0:32]
    colour = np.stack([0.15 + 0.7 * x / 31, 0.15 + 0.7 * y / 31, 0.5 + 0.0 * x], axis=-1)
    return np.where(((x // 8 + y // 8) % 2 == 0)[..., None], colour, 0.25 * colour)


def sky() -> np.ndarray:
    """A blue sky over brown earth with a small bright sun, in latitude and longitude."""
    y, x = np.mgrid[0:16, 0:32]
    up = ((7.5 - y) / 7.5)[..., None]
    image = np.where(up > 0.0, [0.4, 0.6, 1.0] * (1.0 - 0.5 * up), [0.2, 0.15, 0.1])
    image[4:6, 6:8] = [30.0, 28.0, 24.0]
    return image + 0.0 * x[..., None]


def bowl() -> str:
    """A paraboloid with texture coordinates but no normals, as OBJ."""
    u, v = (np.mgrid[0:13, 0:13] / 12.0).reshape(2, -1)
    points = np.stack([2 * u - 1, (2 * u - 1) ** 2 / 2 + (2 * v - 1) ** 2 / 2, 1 - 2 * v], axis=1)
    rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    rows += [f"vt {a:.6f} {b:.6f}" for a, b in zip(u, v, strict=True)]
    for i in range(12):
        for j in range(12):
            corner = 13 * i + j + 1
            quad = (corner, corner + 13, corner + 14, corner + 1)
            rows.append("f " + " ".join(f"{k}/{k}" for k in quad))
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    images.write(HERE / "tiles.png", tiles().astype(np.float32))
    images.write(HERE / "sky.exr", sky().astype(np.float32), half=False)
    (HERE / "bowl.obj").write_text("# A paraboloid, made by make_assets.py\n" + bowl())
