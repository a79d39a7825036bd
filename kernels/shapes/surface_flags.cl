/* Material words; bits of ShapeRow.flags. */
#include "generated/shape_bits.cl"
#include "generated/material_kinds.cl"

/* A material word names a leaf: its kind in the upper 8 bits, the first word of its row below. */
#define MATERIAL_KIND(w) (((w) >> 24) & 0xff)
#define MATERIAL_ROW(w) ((w) & 0xffffff)
