"""Spectra of a Mitsuba scene that need no colour: Mitsuba's, and clpt's own."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import spectra
from clpt.formats.mitsuba.properties import PluginReader, Properties, numbers
from clpt.spectra import LED, Blackbody, Cauchy, Constant, Lines, Sellmeier, Spectrum, Tabulated


def _uniform(props: Properties) -> Spectrum:
    return Constant(props.number("value", 1.0))


def _blackbody(props: Properties) -> Spectrum:
    return Blackbody(
        props.number("temperature", 5000.0),
        props.number("scale", 1.0),
        props.flag("normalised", False),
    )


def _irregular(props: Properties) -> Spectrum:
    return Tabulated(_list(props, "wavelengths"), _list(props, "values"))


def _regular(props: Properties) -> Spectrum:
    values = _list(props, "values")
    low, high = props.number("wavelength_min", 360.0), props.number("wavelength_max", 830.0)
    return Tabulated(np.linspace(low, high, len(values)), values)


def _illuminant(props: Properties) -> Spectrum:
    return spectra.illuminant(props.text("name", "D65"), props.number("scale", 1.0))


def _lines(props: Properties) -> Spectrum:
    return Lines(
        _list(props, "wavelengths"),
        _list(props, "powers"),
        props.number("width", 1.0),
        props.number("scale", 1.0),
    )


def _led(props: Properties) -> Spectrum:
    return LED(props.number("peak", 530.0), props.number("width", 20.0), props.number("scale", 1.0))


def _glass(props: Properties) -> Spectrum:
    return spectra.glass(props.text("name", "bk7"))


def _sellmeier(props: Properties) -> Spectrum:
    return Sellmeier(tuple(_list(props, "b")), tuple(_list(props, "c")), props.number("a", 1.0))


def _cauchy(props: Properties) -> Spectrum:
    return Cauchy(props.number("a", 1.5), props.number("b", 0.0), props.number("c", 0.0))


def _list(props: Properties, name: str) -> list[float]:
    child = props.take(name)
    if child is None:
        raise props.element.error(f"needs the parameter {name!r}")
    return numbers(child, "value")


PLAIN: dict[str, PluginReader[Any]] = {
    "uniform": _uniform,
    "blackbody": _blackbody,
    "irregular": _irregular,
    "regular": _regular,
    "illuminant": _illuminant,
    "lines": _lines,
    "led": _led,
    "glass": _glass,
    "sellmeier": _sellmeier,
    "cauchy": _cauchy,
}
