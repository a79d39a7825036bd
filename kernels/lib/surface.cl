/* Where a path is: the point that a ray hit, with all that shading asks for. */
#define SHAPE_NORMALS 1   /* its vertices have normals */
#define SHAPE_UVS 2       /* its vertices have uv */
#define SHAPE_FLIP 4      /* its front is on the other side */
#define SHAPE_ONE_LIGHT 8 /* all of its primitives are one row of `lights` */
#define SHAPE_TWO_SIDED 16 /* the back is shaded as if it were a front */

/* A material word names a leaf: its kind in the upper 8 bits, the first word of its row below. */
#define MATERIAL_KIND(w) (((w) >> 24) & 0xff)
#define MATERIAL_ROW(w) ((w) & 0xffffff)

typedef struct {
    vec3 p;       /* [m] */
    vec3 n;       /* geometric normal, unit length, on the side of the front */
    vec3 ns;      /* shading normal, unit length */
    vec3 dpdu;    /* along the surface's u; not normalised, may be zero */
    vec2 uv;
    integer light; /* row in `lights`, -1: does not emit */
} Surface;
