/* Stands for path/screen_motion_record.cl where nothing moves. */
inline void screen_motion_record(Scene scene, integer *words, mask first, Vertex v, real weight)
{
    for (int i = 0; i < 12; i++) words[i] = 0;
}
