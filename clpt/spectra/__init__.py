"""Spectra: observers, illuminants, metals, glasses, and RGB made spectral.

Wavelengths are in nm throughout. A scene holds `Spectrum` objects; `on_grid` fills device tables.
"""

from clpt.spectra.bispectral import read_bispectral, read_reradiation
from clpt.spectra.cie import (
    CIE_Y_INTEGRAL,
    LAMBDA_MAX,
    LAMBDA_MIN,
    REC709_TO_XYZ,
    XYZ_TO_REC709,
    cie_xyz,
    luminance,
    rgb_to_xyz,
    sample_wavelengths,
    wavelength_pdf,
    xyz_to_rgb,
)
from clpt.spectra.emission import (
    LED,
    LUMENS,
    UNIT_LUMINANCE,
    Blackbody,
    Illuminant,
    Lines,
    illuminant,
    illuminants,
    lumens,
    scaled,
    watts,
)
from clpt.spectra.files import read_absorption, read_index, read_refractive_index, read_table
from clpt.spectra.named import glass, glasses, index, metal, metals
from clpt.spectra.reradiation import Donaldson, Fluorophore, Reradiation
from clpt.spectra.sensors import Sensor, observer, read_sensor
from clpt.spectra.spectrum import (
    RGB,
    Cauchy,
    Constant,
    RGBIlluminant,
    RGBUnbounded,
    Sellmeier,
    Spectrum,
    Tabulated,
    absorption,
    on_grid,
)
from clpt.spectra.upsampling import unbounded, uplift

__all__ = [
    "CIE_Y_INTEGRAL",
    "LAMBDA_MAX",
    "LAMBDA_MIN",
    "LED",
    "LUMENS",
    "REC709_TO_XYZ",
    "RGB",
    "UNIT_LUMINANCE",
    "XYZ_TO_REC709",
    "Blackbody",
    "Cauchy",
    "Constant",
    "Donaldson",
    "Fluorophore",
    "Illuminant",
    "Lines",
    "RGBIlluminant",
    "RGBUnbounded",
    "Reradiation",
    "Sellmeier",
    "Sensor",
    "Spectrum",
    "Tabulated",
    "absorption",
    "cie_xyz",
    "glass",
    "glasses",
    "illuminant",
    "illuminants",
    "index",
    "lumens",
    "luminance",
    "metal",
    "metals",
    "observer",
    "on_grid",
    "read_absorption",
    "read_bispectral",
    "read_index",
    "read_refractive_index",
    "read_reradiation",
    "read_sensor",
    "read_table",
    "rgb_to_xyz",
    "sample_wavelengths",
    "scaled",
    "unbounded",
    "uplift",
    "watts",
    "wavelength_pdf",
    "xyz_to_rgb",
]
