/* Sums the planes of the film into a picture, pixel by pixel, and takes it to the output space by the matrix in the
 * settings; the fourth value of a pixel is its number of samples. Planes are added in a fixed order, so a picture
 * does not depend on timing. */
#include "core/base.cl"
#include "film/film.cl"

#ifdef LIGHT_PATHS /* the host says how many light paths there were per pixel: each may have lit any pixel */
#define SAMPLES_ARG , float samples
#define SAMPLES(own) samples
#else
#define SAMPLES_ARG
#define SAMPLES(own) own
#endif

kernel void accumulate(global const Settings *settings, global const float *film, global float *image SAMPLES_ARG)
{
    int x = get_global_id(0), y = get_global_id(1);
    if (x < settings->width && y < settings->height) {
        float v[FILM_WORDS];
        film_sum(settings, film, film_pixel_index(settings, x, y), 0, FILM_WORDS, v);
        float scale = SAMPLES(v[6]) > 0.0f ? 1.0f / SAMPLES(v[6]) : 1.0f;
        float a = (v[0] + v[3]) * scale, b = (v[1] + v[4]) * scale, c = (v[2] + v[5]) * scale;
        global float *pixel = image + 4 * ((size_t)y * settings->width + x);
        pixel[0] = settings->to_first[0] * a + settings->to_first[1] * b + settings->to_first[2] * c;
        pixel[1] = settings->to_second[0] * a + settings->to_second[1] * b + settings->to_second[2] * c;
        pixel[2] = settings->to_third[0] * a + settings->to_third[1] * b + settings->to_third[2] * c;
        pixel[3] = SAMPLES(v[6]);
    }
}
