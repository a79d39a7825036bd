/* Bodies that overlap: the body of highest priority fills a point (Schmidt and Budge 2002, "Simple Nested
 * Dielectrics in Ray Traced Images"). Bodies of the same matter share a number from 1 to 255, which rises with the
 * priority. The bodies around a point are the four bytes of a word, in any order, 0 for an empty byte; a fifth body
 * is lost. `media` holds two words for each shape, the number of its body first. Behind them follow two words for
 * each number: the name of the medium, and where the index stands in `materials`, 0 without an index. For number 0
 * the first word is the material word of a null surface. media/light_media.cl says what stands before. */

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
