/* How what a path sees moves across the film while the shutter is open: from where it is at the path's time to where it
 * was when the shutter opened, and to where it will be when it closes, to the right and up [pixels]. */
#include "film/layers.cl"
#include "motion/motion.cl"

typedef struct {
    vec2 backward, forward; /* [pixels] */
} ScreenMotion;

/* A point of the scene's shape of this number, as it is at another time. */
inline vec3 point_at_time(Scene scene, integer object, vec3 p, real time)
{
    vec3 rest = motion_point_back(motion_of_shape(scene, object), p);
    scene.time = time;
    return motion_point(motion_of_shape(scene, object), rest);
}

/* Where on the film it is at a time [pixels], y down; p: a point, or where `away` a unit vector. */
inline vec2 screen_at_time(Scene scene, vec3 p, mask away, real time, mask *seen)
{
    scene.time = time;
    Motion m = motion_at(scene, (integer)(as_int(scene.distributions[MOTION_ROW + 1])));
    vec2 film = camera_screen(scene, sel3(away, motion_back(m, p), motion_point_back(m, p)), away, seen);
    film.x *= (float)scene.settings->film_width;
    film.y *= (float)scene.settings->film_height;
    return film;
}

/* object: the shape that is seen, below 0 for what stands still; p: the point, or where `away` the unit vector to what
 * is infinitely far; first, last: p, but that the shape has deformed as when the shutter opens and closes. Nothing
 * moves that is behind the camera at one of the three times. */
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

/* Adds the motion of the sky, which the `unseen` paths have come to. */
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
