/* The motion of a point across the film while the shutter is open: from its position at the path's time to the position
 * when the shutter opened, and to the position when it closes, to the right and up [pixels]. */
/* Step. */
#include "film/layers.cl"
#include "motion/motion.cl"

typedef struct {
    vec2 backward, forward; /* [pixels] */
} ScreenMotion;

/* A point of the scene's shape of this number, at another time. */
inline vec3 point_at_time(Scene scene, integer object, vec3 p, real time)
{
    vec3 rest = motion_point_back(motion_of_shape(scene, object), p);
    scene.time = time;
    return motion_point(motion_of_shape(scene, object), rest);
}

/* Its position on the film at a time [pixels], y down; p: a point, or where `away` a unit vector. */
inline vec2 screen_at_time(Scene scene, vec3 p, mask away, real time, mask *seen)
{
    scene.time = time;
    Motion m = motion_at(scene, (integer)(as_int(scene.distributions[MOTION_ROW + 1])));
    vec2 film = camera_screen(scene, sel3(away, motion_back(m, p), motion_point_back(m, p)), away, seen);
    film.x *= (float)scene.settings->film_width;
    film.y *= (float)scene.settings->film_height;
    return film;
}

/* object: the shape, below 0 if it stands still; p: the point, or where `away` the unit vector to a point at infinity;
 * first, last: p on the shape as it has deformed when the shutter opens and closes. A point that is behind the camera
 * at any of the three times does not move. */
inline ScreenMotion screen_motion(Scene scene, integer object, vec3 p, vec3 first, vec3 last, mask away)
{
    global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
    real opens = shutter[1], closes = shutter[1] + shutter[2];
    mask moves = !away & (object >= 0), seen = mask_of(1);
    if (any(moves)) {
        integer number = sel_i(moves, object, (integer)(0));
        first = sel3(moves, point_at_time(scene, number, first, opens), first);
        last = sel3(moves, point_at_time(scene, number, last, closes), last);
    }
    vec2 at = screen_at_time(scene, p, away, scene.time, &seen);
    vec2 before = screen_at_time(scene, first, away, opens, &seen);
    vec2 after = screen_at_time(scene, last, away, closes, &seen);
    real none = 0.0f;
    ScreenMotion s;
    s.backward.x = sel(seen, before.x - at.x, none);
    s.backward.y = sel(seen, at.y - before.y, none);
    s.forward.x = sel(seen, after.x - at.x, none);
    s.forward.y = sel(seen, at.y - after.y, none);
    return s;
}

/* Puts it into the words of the layer. */
inline void screen_motion_put(integer *words, mask m, ScreenMotion s, real weight)
{
    layer_put_long(words, m, s.backward.x * weight);
    layer_put_long(words + LAYER_LONG_WORDS, m, s.backward.y * weight);
    layer_put_long(words + 2 * LAYER_LONG_WORDS, m, s.forward.x * weight);
    layer_put_long(words + 3 * LAYER_LONG_WORDS, m, s.forward.y * weight);
}

/* Adds the motion of the sky, where the `unseen` paths have come to. */
inline void layers_of_sky(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS)
{
    mask m = layers_want(path, at, unseen);
    if (!any(m)) return;
    integer words[4 * LAYER_LONG_WORDS];
    vec3 d = sel3(m, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f));
    ScreenMotion s = screen_motion(scene, (integer)(-1), d, d, d, mask_of(1));
    screen_motion_put(words, m, s, layer_weight(path, at));
    layers_add(scene, layers + scene.settings->layer_motion, m, load_path_pixel_index(path, at), words,
               4 * LAYER_LONG_WORDS);
}

/* Twin, where no layer tells how what is seen moves. */
inline void layers_of_sky(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS) {}

/* Step record: puts the motion of the first surface into the words of the layer of motion. */
inline void screen_motion_record(Scene scene, integer *words, mask first, Vertex v, real weight)
{
    vec3 opens = v.s.p, closes = v.s.p;
#if MOVES_VERTICES || MOVES_SPHERES
    opens = add3(v.s.p, v.s.to_open);
    closes = add3(v.s.p, v.s.to_close);
#endif
    ScreenMotion motion = screen_motion(scene, v.object, v.s.p, opens, closes, mask_of(0));
    screen_motion_put(words, first, motion, weight);
}

/* Twin, where nothing moves. */
#include "film/layers.cl"
inline void screen_motion_record(Scene scene, integer *words, mask first, Vertex v, real weight)
{
    for (int i = 0; i < 4 * LAYER_LONG_WORDS; i++) words[i] = 0;
}
