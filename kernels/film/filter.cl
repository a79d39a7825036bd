/* Pixel filters by importance sampling: a sample serves its own pixel, at an offset drawn from |f|.
 * Filters are separable and even, so one half of one dimension is tabulated (clpt/render/film/filters.py)
 * at the beginning of `distributions`: the number of cells n, n + 1 distances that bound cells of
 * equal probability, and the weight of each cell, which is negative where f is. */
inline void filter_sample_axis(Scene scene, real u, real *offset, real *weight)
{
    int n = (int)scene.distributions[0];
    real side = 2.0f * u - 1.0f, x = fabs(side) * (float)n;
    integer i = min_i(to_integer(x), (integer)(n - 1));
    real a = gather(scene.distributions, i + 1), b = gather(scene.distributions, i + 2);
    real distance = a + (x - to_real(i)) * (b - a);
    *offset = sel(side < 0.0f, -distance, distance);
    *weight *= gather(scene.distributions, i + (n + 2));
}

/* offset: from the pixel's centre [pixels]; weight: what the sample counts, 1 on average. */
inline void filter_sample(Scene scene, vec2 u, vec2 *offset, real *weight)
{
    *weight = 1.0f;
#ifdef FILTER_BOX
    float radius = scene.distributions[2];
    offset->x = (2.0f * u.x - 1.0f) * radius;
    offset->y = (2.0f * u.y - 1.0f) * radius;
#else
    filter_sample_axis(scene, u.x, &offset->x, weight);
    filter_sample_axis(scene, u.y, &offset->y, weight);
#endif
}
