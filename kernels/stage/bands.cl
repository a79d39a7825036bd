/* Makes a picture of a spectral film: settings->bands values a pixel [W m^-2 sr^-1 nm^-1]. halves: see
 * film/picture.cl. */
#include "core/base.cl"
#include "film/picture.cl"
#include "film/bands.cl"

kernel void accumulate_bands(global const Settings *settings, global const uint *film, global const uint *bands,
                             global float *band_image, int2 halves LIGHT_PATHS_ARG)
{
    int x = get_global_id(0), y = get_global_id(1), count = settings->bands;
    if (x < settings->width && y < settings->height) {
        int pixel_index = film_pixel_index(settings, x, y);
        size_t stream = settings->padded_pixels;
        size_t size = 3 * stream * count * FILM_GROUPS; /* words of a half */
        float samples = SAMPLES, scale = film_mean(settings, film, pixel_index, halves, samples) / settings->film_scale;
        global float *pixel = band_image + (size_t)count * ((size_t)y * settings->width + x);
        for (int band = 0; band < count; band++)
            pixel[band] = halves_sum(bands + bands_at(settings, 0, 0, band, pixel_index), stream, size, halves) * scale;
#if SUMS_LIGHT_PATHS
        float share = light_paths_mean(light_paths, samples) / settings->film_scale;
        for (int band = 0; band < count; band++) {
            size_t sum = bands_at(settings, 0, 1, band, pixel_index);
            pixel[band] += halves_sum(bands + sum, stream, size, halves) * share;
        }
#endif
    }
}
