/* A spot that shines through an image: of the square around the cone, a metre before it, with x to the
 * right and y up (Mitsuba's spot with a texture). */
inline Spot image_spot_bare(ImageSpot l)
{
    return (Spot){l.position, l.z, l.cutoff, l.beam_width, l.edge, l.radiance};
}

/* What the image lets through along d, a direction in the cone. */
inline Spectrum image_spot_factor(ImageSpot l, Scene scene, vec3 d, Wavelengths lambdas)
{
    real z = dot3(d, l.z), half_size = 0.5f / sel(z > 0.0f, z, (real)(1.0f));
    vec2 uv = {0.5f + dot3(d, l.x) * half_size, 0.5f + dot3(d, l.y) * half_size};
    return factor_load(scene, l.factor, texture_point(uv, l.position), lambdas);
}

LightSample image_spot_sample(ImageSpot l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    LightSample s = spot_sample(image_spot_bare(l), scene, p, u, lambdas);
    s.radiance = spectrum_mul(s.radiance, image_spot_factor(l, scene, neg3(s.wi), lambdas));
    return s;
}

/* Step emission: rays as of a spot without an image; their power follows the image too. */
Spectrum image_spot_intensity(ImageSpot l, Scene scene, vec3 d, Wavelengths lambdas)
{
    Spectrum sent = spot_intensity(image_spot_bare(l), scene, d, lambdas);
    return spectrum_mul(sent, image_spot_factor(l, scene, d, lambdas));
}

LightRay image_spot_emit(ImageSpot l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    LightRay r = spot_emit(image_spot_bare(l), scene, u, v, lambdas);
    r.power = spectrum_mul(r.power, image_spot_factor(l, scene, r.d, lambdas));
    return r;
}

real image_spot_emit_pdf(ImageSpot l, vec3 d) { return spot_emit_pdf(image_spot_bare(l), d); }
