/* Sums the planes of a spectral film into a picture of settings->bands values a pixel. */
#include "lib/base.cl"
#include "lib/film.cl"
#include "lib/bands.cl"

kernel void accumulate_bands(global const Settings *settings, global const float *film, global const float *bands,
                             global float *band_image)
{
    int x = get_global_id(0), y = get_global_id(1), places = settings->places, count = settings->bands;
    if (x < settings->width && y < settings->height) {
        int place = ((y >> 2) * settings->tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
        float samples = 0.0f;
        for (int plane = 0; plane < settings->planes; plane++)
            samples += film[(plane * FILM_WORDS + FILM_WORDS - 1) * places + place];
        float scale = 1.0f / fmax(samples, 1.0f);
        global float *pixel = band_image + (size_t)count * ((size_t)y * settings->width + x);
        for (int band = 0; band < count; band++) {
            float sum = 0.0f, rest = 0.0f;
            for (int plane = 0; plane < settings->planes; plane++) {
                global const float *first = bands + 2 * (plane * count + band) * places + place;
                sum += first[0];
                rest += first[places];
            }
            pixel[band] = (sum + rest) * scale;
        }
    }
}
