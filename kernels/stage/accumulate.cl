/* Makes a preview of the film, pixel by pixel: means of sums, taken to the output space by the
 * matrix in the settings; the fourth value of a pixel is its number of samples. The same steps as in
 * clpt/render/film/developed.py, which makes the final pictures: so nothing is contracted. */
#include "core/base.cl"
#include "film/picture.cl"
#pragma OPENCL FP_CONTRACT OFF

kernel void accumulate(global const Settings *settings, global const uint *film, global float *image LIGHT_PATHS_ARG)
{
    int x = get_global_id(0), y = get_global_id(1);
    if (x < settings->width && y < settings->height) {
        int pixel_index = film_pixel_index(settings, x, y);
        float count = SAMPLES, mean = film_mean(settings, film, pixel_index, count);
        vec3 v = scale3(film_sum(settings, film, pixel_index, 0), mean);
#if SUMS_LIGHT_PATHS
        vec3 brought = film_sum(settings, film, pixel_index, FILM_GROUP_WORDS);
        v = add3(v, scale3(brought, light_paths_mean(light_paths, count)));
#endif
        global float *pixel = image + 4 * ((size_t)y * settings->width + x);
        pixel[0] = settings->to_first[0] * v.x + settings->to_first[1] * v.y + settings->to_first[2] * v.z;
        pixel[1] = settings->to_second[0] * v.x + settings->to_second[1] * v.y + settings->to_second[2] * v.z;
        pixel[2] = settings->to_third[0] * v.x + settings->to_third[1] * v.y + settings->to_third[2] * v.z;
        pixel[3] = count;
    }
}
