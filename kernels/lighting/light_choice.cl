/* Choosing one row of `lights`, by the alias method (Walker 1977). */
inline LightRow light_at(Scene scene, integer row)
{
    return light_row_row(scene.lights, row * LIGHT_ROW_WORDS);
}

/* Where there are few lights, the number that chooses one is good enough to go on with: the light and
 * the point on it then come from one well-spread pair. Of many, it would have no bits left. */
#ifndef FEW_LIGHTS
#define FEW_LIGHTS 0
#endif

/* A row of `lights`: *u chooses a row, and by its fraction either that row or its alias; what is left of it is uniform
 * in [0, 1) again. */
inline integer light_pick(Scene scene, real *u)
{
    int count = scene.settings->light_count;
    if (count == 1) return (integer)(0);
    real position = *u * (float)count;
    integer row = min_i(to_integer(position), (integer)(count - 1));
    LightRow l = light_at(scene, row);
    real remainder = position - to_real(row);
    mask stay = remainder < l.keep;
    real left = sel(stay, remainder, remainder - l.keep), share = sel(stay, l.keep, 1.0f - l.keep);
    *u = clamp_r(left / max_r(share, (real)(1e-20f)), (real)(0.0f), (real)(0.99999994f));
    return sel_i(stay, row, l.alias);
}

/* With the probability of the row in it; a delta light keeps its mark and carries it as a factor. */
inline LightSample light_chosen(LightSample s, real pmf)
{
    mask delta = s.pdf < 0.0f;
    s.radiance = spectrum_scale(s.radiance, sel(delta, 1.0f / max_r(pmf, (real)(1e-30f)), (real)(1.0f)));
    s.pdf = sel(delta, s.pdf, s.pdf * pmf);
    return s;
}
