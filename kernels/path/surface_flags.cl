/* Bits of ShapeRow.flags, and material words. */
#define SHAPE_NORMALS 1   /* its vertices have normals */
#define SHAPE_UVS 2       /* its vertices have uv */
#define SHAPE_ONE_LIGHT 8  /* all of its primitives are one row of `lights` */
#define SHAPE_TWO_SIDED 4  /* the back is shaded as if it were a front */
#define SHAPE_MANY 16      /* a primitive is one of its spheres; attributes are per sphere */
#define SHAPE_TANGENTS 32  /* its vertices have tangents of their own */
#define SHAPE_DEFORMS 64   /* its vertices move by themselves */


/* A material word names a leaf: its kind in the upper 8 bits, the first word of its row below. */
#define MATERIAL_KIND(w) (((w) >> 24) & 0xff)
#define MATERIAL_ROW(w) ((w) & 0xffffff)
