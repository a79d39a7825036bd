/* Choice of a row of `lights` by the alias method (Walker 1977). */
inline LightRow light_at(Scene scene, integer row)
{
    return light_row_row(scene.lights, row * LIGHT_ROW_WORDS);
}

/* Where there are few lights, the number that chooses one is good enough to go on with: the light and
 * the point on it then come from one well-spread pair. Of many, it would have no bits left. */
#ifndef FEW_LIGHTS
#define FEW_LIGHTS 0
#endif

/* A random number has 23 bits, and every choice by it spends some. This stands for those below: uniform in [0, grain);
 * other: a random number of the same sample; choice: another word for each choice. Neither may follow from a number
 * that was rounded: a device that rounds otherwise would choose other lights everywhere. */
inline real light_bits(natural choice, real other, real grain)
{
    return unit_interval(hash_natural(choice ^ hash_natural(as_natural(other)))) * grain;
}

/* A row of `lights`; *u: chooses a row, or its alias by the fraction; then uniform again. other: see light_bits. */
inline integer light_pick(Scene scene, real *u, real other)
{
    int count = scene.settings->light_count;
    if (count == 1) return (integer)(0);
    real position = *u * (float)count, whole = floor(position), remainder = position - whole;
#if !FEW_LIGHTS
    remainder += light_bits(as_natural(*u), other, (real)((float)count * UNIT_GRAIN));
    whole += floor(remainder);
    remainder -= floor(remainder);
#endif
    integer row = min_i(to_integer(whole), (integer)(count - 1));
    LightRow l = light_at(scene, row);
    mask stay = remainder < l.keep;
    real left = sel(stay, remainder, remainder - l.keep), share = sel(stay, l.keep, 1.0f - l.keep);
    *u = clamp_r(left / max_r(share, (real)(1e-20f)), (real)(0.0f), (real)(0.99999994f));
    return sel_i(stay, row, l.alias);
}

/* A sample with the chance of its row in the pdf; a delta light has it as a factor of its radiance. */
inline LightSample light_chosen(LightSample s, real pmf)
{
    mask delta = s.pdf < 0.0f;
    s.radiance = spectrum_scale(s.radiance, sel(delta, 1.0f / max_r(pmf, (real)(1e-30f)), (real)(1.0f)));
    s.pdf = sel(delta & (pmf > 0.0f), s.pdf, max_r(s.pdf, (real)(0.0f)) * pmf);
    return s;
}
