"""Features of spectra: the mode, and the grid of tabulated ones."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import macro, number


@dataclass(frozen=True)
class SpectraFeatures:
    """The mode, and the grid of tabulated spectra."""

    mode: str = "rgb"
    size: int = number("SPECTRA_SIZE")  # values of a spectrum
    step: float = 1.0  # between them [nm]
    tabulated_density: bool = False  # of wavelengths

    @property
    def spectral(self) -> bool:
        """Whether paths have wavelengths."""
        return self.mode == "spectral"

    @property
    @macro("SPECTRA_STEP")
    def step_text(self) -> str:
        """The step in the text of kernels."""
        return f"{self.step}f"
