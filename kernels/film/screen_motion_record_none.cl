/* Stands for film/screen_motion_record.cl where nothing moves. */
#include "film/layers.cl"
inline void screen_motion_record(Scene scene, integer *words, mask first, Vertex v, real weight)
{
    for (int i = 0; i < 4 * LAYER_LONG_WORDS; i++) words[i] = 0;
}
