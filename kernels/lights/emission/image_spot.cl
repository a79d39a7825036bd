/* A spot with an image sends its rays as one without; their power follows the image too. */
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
