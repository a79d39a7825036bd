"""Files of PBRT: `clpt.formats.pbrt.scenes` reads them."""
