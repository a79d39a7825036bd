/* Bodies that overlap: the body of highest priority fills a point (Schmidt and Budge 2002, "Simple Nested
 * Dielectrics in Ray Traced Images"). Bodies of the same matter share a number from 1 to 255, which rises with the
 * priority. The bodies around a point are the four bytes of a word, in any order, 0 for an empty byte; a fifth body
 * is lost. `media` holds two words for each shape, the number of its body first. Behind them follow two words for
 * each number: the name of the medium, and where the index stands in `materials`, 0 without an index. For number 0
 * the first word is the material word of a null surface. media/medium.cl says what stands before. */

/* The bodies where a shadow ray begins, at the camera and at a light. */
inline integer camera_through(Scene scene) { return (integer)(scene.settings->camera_bodies); }
inline integer light_through(Scene scene, integer row) { return light_bodies(scene, row); }

inline integer bodies_top(integer bodies)
{
    integer low = max_i(bodies & 0xff, (bodies >> 8) & 0xff);
    return max_i(low, max_i((bodies >> 16) & 0xff, (bodies >> 24) & 0xff));
}

inline integer bodies_with(integer bodies, integer body)
{
    return sel_i((bodies & (int)0xff000000) != 0, bodies, (bodies << 8) | body);
}

inline integer bodies_without(integer bodies, integer body)
{
    integer r = bodies, rest = (bodies >> 8) & 0xffffff;
    r = sel_i(((bodies >> 24) & 0xff) == body, bodies & 0xffffff, r);
    r = sel_i(((bodies >> 16) & 0xff) == body, (bodies & 0xffff) | (rest & 0xff0000), r);
    r = sel_i(((bodies >> 8) & 0xff) == body, (bodies & 0xff) | (rest & 0xffff00), r);
    return sel_i((bodies & 0xff) == body, rest, r);
}

inline integer body_word(Scene scene, integer body, int word)
{
    return gather_i(scene.media, MEDIA_OF_SHAPES + 2 * (scene.settings->shape_count + body) + word);
}
inline integer body_medium(Scene scene, integer body)
{
    return sel_i(body != 0, body_word(scene, body, 0), (integer)(0));
}

/* A surface that a ray hits among bodies. */
typedef struct {
    integer body;   /* behind its front; 0: none */
    integer others; /* bodies around its front */
    integer next;   /* the body that fills the point before its front */
    mask hidden;    /* that body fills the point behind too, and hides the surface */
} BodyBoundary;

inline BodyBoundary body_boundary(Scene scene, integer shape, integer bodies, mask front)
{
    BodyBoundary b;
    b.body = gather_i(scene.media, MEDIA_OF_SHAPES + 2 * shape);
    b.others = sel_i(front | (b.body == 0), bodies, bodies_without(bodies, b.body));
    b.next = bodies_top(b.others);
    b.hidden = (b.body != 0) & (b.next >= b.body);
    return b;
}

/* The bodies around a ray beyond the surface; inward: the ray goes to the back. */
inline integer bodies_beyond(BodyBoundary b, mask inward)
{
    return sel_i(inward & (b.body != 0), bodies_with(b.others, b.body), b.others);
}

/* Twin, where bodies do not overlap: a shadow ray begins with the name of its medium. */
inline integer camera_through(Scene scene) { return (integer)(scene.settings->camera_medium); }
inline integer light_through(Scene scene, integer row) { return light_medium(scene, row); }

/* Step between: the exterior index of a dielectric among overlapping bodies: the index of the body of highest priority
 * there. */
inline void bsdf_between_bodies(Scene scene, mask active, Vertex v, Bsdf *m)
{
    integer index = body_word(scene, v.media.bodies.next, 1);
    mask known = active & (v.media.bodies.next != 0) & (index != 0);
    if (any(known)) {
        Spectrum outside = body_index(scene, sel_i(known, index, (integer)(0)), texture_point_nowhere(), v.lambdas);
        m->ext_ior = spectrum_sel(known, outside, m->ext_ior);
    }
}

/* Twin, where a material keeps its own exterior index. */
inline void bsdf_between_bodies(Scene scene, mask active, Vertex v, Bsdf *m) {}

/* Step vertex: the media around a vertex of a path among overlapping bodies. */
typedef struct {
    integer medium;      /* incident: the ray travelled in it */
    integer inside;      /* interior: behind the surface */
    integer outside;     /* exterior: before the surface */
    BodyBoundary bodies;
} VertexMedia;

inline VertexMedia vertex_media(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, mask front)
{
    VertexMedia m;
    integer bodies = sel_i(active, load_path_bodies(path, at), (integer)(0));
    integer shape_row = BSDF_IS_PHASE ? (integer)(0) : sel_i(active, load_hit_shape(hit, at), (integer)(0));
    m.bodies = body_boundary(scene, shape_row, bodies, front);
    if (BSDF_IS_PHASE) {
        m.bodies.body = 0;
        m.bodies.others = bodies;
    }
    m.inside = body_medium(scene, bodies_top(bodies_beyond(m.bodies, mask_of(1))));
    m.outside = body_medium(scene, bodies_top(m.bodies.others));
    m.medium = sel_i(active, load_path_medium(path, at), (integer)(0));
    return m;
}

/* Step shadow: boundaries along a shadow ray among bodies: the word of bodies tells its medium. */
inline integer shadow_medium(Scene scene, integer bodies, mask active, integer medium)
{
    return body_medium(scene, bodies_top(sel_i(active, bodies, (integer)(0))));
}

/* The transmittance of a surface: 1 where a body of higher priority hides it. *bodies become the bodies beyond. */
inline Passage shadow_passage(Scene scene, integer row, integer *bodies, mask front, int surfaces, Passage own)
{
    BodyBoundary boundary = body_boundary(scene, row, *bodies, front);
    *bodies = bodies_beyond(boundary, front);
    return passage_sel(boundary.hidden & mask_of(surfaces < MOST_NULL_SURFACES), passage_of(1.0f), own);
}

#define shadow_medium_beyond(scene, row, bodies, active, front, medium) shadow_medium(scene, bodies, active, medium)

/* Twin, where bodies do not overlap: the interiors and exteriors of shapes tell its medium. */
inline integer shadow_medium(Scene scene, integer bodies, mask active, integer medium) { return medium; }
inline Passage shadow_passage(Scene scene, integer row, integer *bodies, mask front, int surfaces, Passage own)
{
    return own;
}

inline integer shadow_medium_beyond(Scene scene, integer row, integer bodies, mask active, mask front, integer medium)
{
    ShapeMedia sides = shape_media(scene, row);
    return sel_i(active, medium_beyond(medium, sides.inside, sides.outside, front, front), medium);
}
