"""Files of pictures as (h, w, c) float32 arrays, and back; row 0 is the top.

Every picture that clpt takes comes in through `read` or `read_stored`, or through `decoded` where
its bytes stand in another file. Statements of a file on its numbers are heeded: colours are linear
Rec. 709 unless data is asked for. docs/images.md has a table of statements by format.
"""

from clpt.choices import FOR_SCREENS, WRITABLE
from clpt.images.colour import (
    linear_to_srgb,
    multiplied,
    srgb8_steps,
    srgb_to_linear,
    straight,
    to_codes,
    to_rec709,
    to_srgb8,
)
from clpt.images.exr import STOPS, matrix_of, read_channels, read_layers
from clpt.images.exr_files import attributes, part_names, write_channels
from clpt.images.float_files import write_npy as write_npy
from clpt.images.measures import auto_exposure, levels, raised, stops
from clpt.images.picture_files import (
    READERS,
    STRAIGHT,
    check_input,
    check_output,
    log_notes,
    read,
    read_stored,
    write,
    write_stored,
)
from clpt.images.pillow import decoded
from clpt.images.pillow import texts as png_text
from clpt.images.screen_files import png
from clpt.images.stored import Stored, from_array

__all__ = [
    "FOR_SCREENS",
    "READERS",
    "STOPS",
    "STRAIGHT",
    "WRITABLE",
    "Stored",
    "attributes",
    "auto_exposure",
    "check_input",
    "check_output",
    "decoded",
    "from_array",
    "levels",
    "linear_to_srgb",
    "log_notes",
    "matrix_of",
    "multiplied",
    "part_names",
    "png",
    "png_text",
    "raised",
    "read",
    "read_channels",
    "read_layers",
    "read_stored",
    "srgb8_steps",
    "srgb_to_linear",
    "stops",
    "straight",
    "to_codes",
    "to_rec709",
    "to_srgb8",
    "write",
    "write_channels",
    "write_npy",
    "write_stored",
]
