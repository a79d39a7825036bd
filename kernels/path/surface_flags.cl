/* Bits of ShapeRow.flags, material words, and the distances that keep rays off their own surface. */
#define SHAPE_NORMALS 1   /* its vertices have normals */
#define SHAPE_UVS 2       /* its vertices have uv */
#define SHAPE_ONE_LIGHT 8  /* all of its primitives are one row of `lights` */
#define SHAPE_TWO_SIDED 4  /* the back is shaded as if it were a front */
#define SHAPE_MANY 16      /* a primitive is one of its spheres; attributes are per sphere */

#define RAY_EPSILON 5e-5f /* of the size of the coordinates */
#define SHADOW_SHORTER 0.9998f /* a shadow ray ends just before its light */

/* A material word names a leaf: its kind in the upper 8 bits, the first word of its row below. */
#define MATERIAL_KIND(w) (((w) >> 24) & 0xff)
#define MATERIAL_ROW(w) ((w) & 0xffffff)
