/* The change of the film since its last measurement, for adaptive sampling
 * (clpt/render/wavefront/adaptive.py). If a pixel's mean was a after n samples and is b after m, (b - a)^2 n / (m - n)
 * is an estimate of the variance of b, without bias where samples are independent; for samples that are spread evenly
 * it is above the variance. A work-item takes a 4x4 tile; the pixels of the two colours of a chessboard are summed
 * separately. The camera's samples are measured, or light paths where `light_paths` says how many the film has of each
 * pixel; a pixel is as bright as both were when they were measured last. */
#include "core/base.cl"
#include "film/picture.cl"

/* A cell is the pixels of a colour in a square of `side` times `side` pixels. active_cells: the cells to measure,
 * a square's two colours after each other; previous_mean: luminance of every pixel when it was measured last, then
 * the samples that it had, then likewise of light paths; noise_sums: variance, luminance and number of pixels, per
 * tile and colour. */
kernel void noise(global const Settings *settings, global const uint *film, global const uint *active_cells,
                  global float *previous_mean, global float *noise_sums, int side LIGHT_PATHS_ARG)
{
    int tile = get_global_id(0), padded_pixels = settings->padded_pixels;
    int squares = (settings->width + side - 1) / side;
    int row = tile / settings->tiles_x, column = tile - row * settings->tiles_x;
    int square = row * 4 / side * squares + column * 4 / side, group = 0;
    global float *previous = previous_mean;
#if SUMS_LIGHT_PATHS
    global float *beside = previous_mean + 2 * (size_t)padded_pixels; /* the luminance that the others bring */
    if (light_paths > 0.0f) {
        group = FILM_GROUP_WORDS;
        previous = beside;
        beside = previous_mean;
    }
#endif
    for (int colour = 0; colour < 2; colour++) {
        float variance = 0.0f, luminance = 0.0f, pixels = 0.0f;
        for (int i = 0; i < 16 && active_cells[2 * square + colour]; i++) {
            int x = column * 4 + (i & 3), y = row * 4 + (i >> 2), pixel_index = tile * 16 + i;
            if (((x + y) & 1) != colour || x >= settings->width || y >= settings->height) continue;
            float samples = (float)film_samples(settings, film, pixel_index);
#if SUMS_LIGHT_PATHS
            if (group) samples = light_paths;
#endif
            vec3 v = scale3(film_sum(settings, film, pixel_index, group), 1.0f / fmax(samples, 1.0f));
            float now = SPECTRUM_SIZE == 3 ? 0.2126f * v.x + 0.7152f * v.y + 0.0722f * v.z : v.y;
            float change = now - previous[pixel_index], before = previous[padded_pixels + pixel_index];
            if (samples > before) variance += change * change * before / (samples - before);
            pixels += 1.0f;
            previous[pixel_index] = now;
            previous[padded_pixels + pixel_index] = samples;
#if SUMS_LIGHT_PATHS
            now += beside[pixel_index];
#endif
            luminance += fabs(now);
        }
        global float *sums = noise_sums + 3 * (2 * tile + colour);
        sums[0] = variance;
        sums[1] = luminance;
        sums[2] = pixels;
    }
}
