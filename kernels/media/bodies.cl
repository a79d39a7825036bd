/* Bodies that overlap: where several are, that of the highest priority fills the place (Schmidt and Budge 2002, "Simple
 * Nested Dielectrics in Ray Traced Images"). Bodies of the same matter have one number from 1 to 255, the higher the
 * higher their priority. Those around a point are the four bytes of a word, in any order, 0 for none; a fifth is not
 * kept. `media` holds two words for each shape, the number of its body first; behind them two for each number: the name
 * of its medium, and where its index stands in `materials`, 0 where it has none. Number 0 has the material word of a
 * null surface in their place. What stands before: media/medium.cl. */
#define camera_through(settings) ((integer)((settings)->camera_bodies)) /* what a ray to a light begins in */
#define light_through(scene, row) light_bodies(scene, row)

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

/* A surface that a ray meets among bodies. */
typedef struct {
    integer body;   /* behind its front; 0: none */
    integer others; /* bodies around its front */
    integer next;   /* that which fills the place there */
    mask hidden;    /* it fills the place behind too: nothing is to be seen of the surface */
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

/* The bodies around a ray that goes on from there; inward: to the back of the surface. */
inline integer bodies_beyond(BodyBoundary b, mask inward)
{
    return sel_i(inward & (b.body != 0), bodies_with(b.others, b.body), b.others);
}

/* Twin, where bodies do not overlap: a ray to a light knows its medium by name. */
#define camera_through(settings) ((integer)((settings)->camera_medium))
#define light_through(scene, row) light_medium(scene, row)
