/* Sums the planes of a spectral film into a picture of settings->bands values a pixel [W m^-2 sr^-1 nm^-1]. */
#include "core/base.cl"
#include "film/film.cl"
#include "film/bands.cl"

kernel void accumulate_bands(global const Settings *settings, global const float *film, global const float *bands,
                             global float *band_image)
{
    int x = get_global_id(0), y = get_global_id(1), padded_pixels = settings->padded_pixels, count = settings->bands;
    if (x < settings->width && y < settings->height) {
        int pixel_index = film_pixel_index(settings, x, y);
        float samples;
        film_sum(settings, film, pixel_index, FILM_WORDS - 1, 1, &samples);
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
