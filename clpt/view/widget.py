"""The picture of a scene in a notebook, rendered while it is watched and steered: anywidget.

The widget carries between a session and the notebook what a server carries between a session and
the page; in the browser both have the same modules.
"""

from __future__ import annotations

import re
import threading
from collections import deque
from importlib import resources
from typing import Any

import anywidget
import numpy as np

from clpt import images
from clpt.device import Device
from clpt.scene import Scene
from clpt.view.messages import answering, checked, finite
from clpt.view.session import Session

MODULES = (  # of the page; a module stands behind the modules that it imports
    "dom.js", "plot.js", "connection.js", "picture.js", "steering.js", "inspector.js",
    "notebook.js",
)  # fmt: skip
MOST_FRAMES = 2  # on their way to the notebook, which has not confirmed them
FIRST_SECONDS = 3.0  # that an output waits for a picture to keep
CLOSE_SECONDS = 10.0


def _read(name: str) -> str:
    return (resources.files("clpt.view") / "static" / name).read_text(encoding="utf-8")


def joined() -> str:
    """Return the modules of the page as a single module, which a notebook can load."""
    text = "\n".join(map(_read, MODULES))
    text = re.sub(r'^import \{[^}]*\} from "\./[^"]*";\n', "", text, flags=re.MULTILINE)
    return re.sub(r"^export (?!default)", "", text, flags=re.MULTILINE)


class Widget(anywidget.AnyWidget):
    """A scene in a notebook: drag, wheel and keys move the camera, a pixel tells its spectrum.

    scene: at first; device: where it is rendered; options: of `Renderer`. The render goes on in a
    thread while a cell shows the widget, also when the cell has ended. The cell's output has the
    picture as a PNG file too, which a notebook that is saved keeps.
    """

    _esm = joined()
    _css = _read("notebook.css") + ".clpt {" + _read("pixel.css") + "}"  # and nothing else there

    def __init__(self, scene: Scene, device: Device, **options: Any):
        super().__init__()
        self._lock = threading.Lock()
        self._frame: tuple[dict[str, Any], bytes] | None = None  # the newest that was not sent
        self._unconfirmed: deque[int] = deque()
        self._views = 0
        self._shown = threading.Event()
        self._picture: tuple[dict[str, Any], bytes] | None = None
        self._session = Session(scene, device, self, **options)
        self._session.start()
        self.on_msg(self._obey)

    @property
    def scene(self) -> Scene:
        """The scene as it has been steered."""
        return self._session.scene

    def snapshot(self) -> Any:
        """Return the picture as it is, which stays in the notebook as a PNG file."""
        from IPython.display import Image

        image: Any = Image
        return image(self._png(), format="png")

    def stop(self) -> None:
        """End the render, and give the device's memory back; the last picture stays."""
        self._session.close(CLOSE_SECONDS)
        self.send({"type": "stopped"})

    def close(self) -> None:
        """Stop, and take the picture out of all cells."""
        self.stop()
        super().close()

    # what a session calls, from its thread

    def picture(self, header: dict[str, Any], data: bytes) -> None:
        """Queue a picture; it replaces a queued picture."""
        with self._lock:
            self._picture = self._frame = header, data
        self._shown.set()
        self._send_frame()

    def message(self, message: dict[str, Any]) -> None:
        """Tell all views something."""
        self.send(finite(message))

    # what a notebook sends

    def _obey(self, _: object, content: Any, buffers: object) -> None:
        """Do what a view asks for, or say why not."""
        asked = content.get("do") if isinstance(content, dict) else None
        with answering(self.message):
            if asked == "watch":
                self._watch(content.get("watching") is True)
            elif asked == "stop":
                self.stop()
            else:
                request = checked(content)
                if request.name == "shown":
                    self._confirm(request.values["frame"])
                else:
                    self._session.post(request, self.message)

    def _watch(self, watching: bool) -> None:
        self._views = max(0, self._views + (1 if watching else -1))
        self._session.watched(self._views)
        if watching:
            self.message(self._session.state())
            with self._lock:
                self._frame = self._picture
                self._unconfirmed.clear()
            self._send_frame()

    def _confirm(self, frame: int) -> None:
        with self._lock:
            while self._unconfirmed and self._unconfirmed[0] <= frame:
                self._unconfirmed.popleft()
        self._send_frame()

    def _send_frame(self) -> None:
        with self._lock:
            if self._frame is None or len(self._unconfirmed) >= MOST_FRAMES or not self._views:
                return
            (header, data), self._frame = self._frame, None
            self._unconfirmed.append(header["frame"])
        self.send({"type": "frame", "header": finite(header)}, [data])

    # what a saved notebook keeps

    def _png(self) -> bytes:
        """The last picture that was made, as a PNG file; wait a little for the first."""
        self._shown.wait(FIRST_SECONDS)
        with self._lock:
            shown = self._picture
        if shown is None:
            return images.png(np.zeros((1, 1, 3), np.uint8))
        header, data = shown
        return data if header["format"] == "png" else _as_png(data)

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        bundle = super()._repr_mimebundle_(**kwargs)
        data, *more = bundle if isinstance(bundle, tuple) else (bundle,)
        return ({**(data or {}), "image/png": self._png()}, *more)


def _as_png(jpeg: bytes) -> bytes:
    return images.png(images.decoded(jpeg, ("JPEG",)).values)
