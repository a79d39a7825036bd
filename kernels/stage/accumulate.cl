/* Sums the planes of the film into a picture, pixel by pixel, in linear Rec. 709 (or, for `raw` films,
 * as the values are). Planes are added in a fixed order, so a picture does not depend on timing. */
#include "lib/base.cl"
#include "lib/film.cl"

kernel void accumulate(global const Settings *settings, global const float *film, global float *image, int raw)
{
    int x = get_global_id(0), y = get_global_id(1), places = settings->places;
    if (x < settings->width && y < settings->height) {
        int place = ((y >> 2) * settings->tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
        float v[FILM_WORDS];
        for (int i = 0; i < FILM_WORDS; i++) v[i] = 0.0f;
        for (int plane = 0; plane < settings->planes; plane++)
            for (int i = 0; i < FILM_WORDS; i++) v[i] += film[(plane * FILM_WORDS + i) * places + place];
        float scale = 1.0f / fmax(v[6], 1.0f);
        float a = (v[0] + v[3]) * scale, b = (v[1] + v[4]) * scale, c = (v[2] + v[5]) * scale;
        global float *pixel = image + 3 * ((size_t)y * settings->width + x);
#if SPECTRUM_SIZE == 4 /* XYZ to linear Rec. 709 (IEC 61966-2-1) */
        if (!raw) {
            float r = XYZ_TO_REC709_0 * a + XYZ_TO_REC709_1 * b + XYZ_TO_REC709_2 * c;
            float g = XYZ_TO_REC709_3 * a + XYZ_TO_REC709_4 * b + XYZ_TO_REC709_5 * c;
            c = XYZ_TO_REC709_6 * a + XYZ_TO_REC709_7 * b + XYZ_TO_REC709_8 * c;
            a = r;
            b = g;
        }
#endif
        pixel[0] = a;
        pixel[1] = b;
        pixel[2] = c;
    }
}
