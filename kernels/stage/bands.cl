/* Sums the planes of a spectral film into a picture of settings->bands values a pixel. */
#include "core/base.cl"
#include "film/film.cl"
#include "film/bands.cl"

kernel void accumulate_bands(global const Settings *settings, global const float *film, global const float *bands,
                             global float *band_image)
{
    int x = get_global_id(0), y = get_global_id(1), padded_pixels = settings->padded_pixels, count = settings->bands;
    if (x < settings->width && y < settings->height) {
        int pixel_index = ((y >> 2) * settings->tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
        float samples = 0.0f;
        for (int plane = 0; plane < settings->planes; plane++)
            samples += film[(plane * FILM_WORDS + FILM_WORDS - 1) * padded_pixels + pixel_index];
        float scale = 1.0f / fmax(samples, 1.0f);
        global float *pixel = band_image + (size_t)count * ((size_t)y * settings->width + x);
        for (int band = 0; band < count; band++) {
            float sum = 0.0f, compensation = 0.0f;
            for (int plane = 0; plane < settings->planes; plane++) {
                global const float *first = bands + 2 * (plane * count + band) * padded_pixels + pixel_index;
                sum += first[0];
                compensation += first[padded_pixels];
            }
            pixel[band] = (sum + compensation) * scale;
        }
    }
}
