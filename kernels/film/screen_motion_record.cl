/* Puts how what the camera sees moves across the film into the words of the layer of motion. */
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
