/* How much the film has changed since it was looked at last, for adaptive sampling (clpt/render/adaptive.py).
 * If a pixel's mean was a after n samples and is b after m, (b - a)^2 n / (m - n) is an estimate of the variance
 * of b, without bias where samples are independent; of points that are spread evenly it is above the variance. A
 * work-item takes a 4x4 tile, whose pixels count apart by the two colours of a chessboard. */
#include "lib/base.cl"
#include "lib/film.cl"

/* side: pixels of the cells' squares; asked: whether a cell is to be looked at, a square's two colours after
 * each other; former: luminance and samples of every place then; found: three sums per tile and colour. */
kernel void noise(global const Settings *settings, global const float *film, global const uint *asked,
                  global float *former, global float *found, int side)
{
    int tile = get_global_id(0), places = settings->places, squares = (settings->width + side - 1) / side;
    int row = tile / settings->tiles_x, column = tile - row * settings->tiles_x;
    int square = row * 4 / side * squares + column * 4 / side;
    for (int colour = 0; colour < 2; colour++) {
        float variance = 0.0f, luminance = 0.0f, pixels = 0.0f;
        for (int i = 0; i < 16 && asked[2 * square + colour]; i++) {
            int x = column * 4 + (i & 3), y = row * 4 + (i >> 2), place = tile * 16 + i;
            if (((x + y) & 1) != colour || x >= settings->width || y >= settings->height) continue;
            float v[3] = {0.0f, 0.0f, 0.0f}, samples = 0.0f;
            for (int plane = 0; plane < settings->planes; plane++) {
                global const float *at = film + plane * FILM_WORDS * places + place;
                for (int k = 0; k < 3; k++) v[k] += at[k * places] + at[(k + 3) * places];
                samples += at[6 * places];
            }
#if SPECTRUM_SIZE == 3
            float now = (0.2126f * v[0] + 0.7152f * v[1] + 0.0722f * v[2]) / fmax(samples, 1.0f);
#else
            float now = v[1] / fmax(samples, 1.0f);
#endif
            float change = now - former[place], before = former[places + place];
            if (samples > before) variance += change * change * before / (samples - before);
            luminance += fabs(now);
            pixels += 1.0f;
            former[place] = now;
            former[places + place] = samples;
        }
        global float *sums = found + 3 * (2 * tile + colour);
        sums[0] = variance;
        sums[1] = luminance;
        sums[2] = pixels;
    }
}
