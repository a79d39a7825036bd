"""Inputs of shaders: values, or the shaders and outputs that they are connected to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from clpt.formats.usd.document import Document


@dataclass(frozen=True)
class Node:
    """A shader of a stage."""

    document: Document
    shader: UsdShade.Shader

    @property
    def kind(self) -> str:
        """Its identifier, such as UsdUVTexture; "" for none."""
        return str(self.shader.GetIdAttr().Get() or "")

    @property
    def path(self) -> str:
        return str(self.shader.GetPath())

    def source(self, name: str) -> tuple[Node, str] | None:
        """Return the shader and the name of the output that an input is connected to."""
        attribute = self._attribute(name)
        if attribute is None or not UsdShade.Output.IsOutput(attribute):
            return None
        shader = UsdShade.Shader(attribute.GetPrim())
        return Node(self.document, shader), UsdShade.Output(attribute).GetBaseName()

    def value(self, name: str, default: object = None) -> Any:
        """Return an input's value, which an interface of the material may have; else `default`."""
        attribute = self._attribute(name)
        if attribute is None or UsdShade.Output.IsOutput(attribute):
            return default
        value = attribute.Get(self.document.time)
        return default if value is None else value

    def color_space(self, name: str) -> str:
        """Return the color space that an input's value says it has; "" for none."""
        attribute = self._attribute(name)
        return "" if attribute is None else str(attribute.GetColorSpace())

    def number(self, name: str, default: float) -> float:
        """Return an input that is a finite number; `default`, with a warning, for another."""
        value = self.value(name, default)
        if isinstance(value, (int, float)) and np.isfinite(value):
            return float(value)
        self.document.warn(f"{name} is no finite number; {default:g} stands for it", self.path)
        return default

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return an input of several finite numbers; `default`, with a warning, for others."""
        value = self.value(name, default)
        try:
            numbers = tuple(float(number) for number in value)
        except (TypeError, ValueError):
            numbers = ()
        if len(numbers) == len(default) and np.isfinite(numbers).all():
            return numbers
        self.document.warn(
            f"{name} is not {len(default)} finite numbers; {default} stands for it", self.path
        )
        return default

    def layer(self, name: str) -> Sdf.Layer:
        """Return the layer that an input's value stands in; paths are relative to it."""
        stack = self.shader.GetInput(name).GetAttr().GetPropertyStack(self.document.time)
        return stack[0].layer

    def _attribute(self, name: str) -> Usd.Attribute | None:
        port = self.shader.GetInput(name)
        sources = port.GetValueProducingAttributes() if port else ()
        return sources[0] if sources else None
