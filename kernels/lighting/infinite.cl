/* What all infinite lights add to a path that leaves the scene along d, a direction chosen with
 * `pdf` (below 0: delta) where `side` was the one that matters; weighted against the choice of that
 * direction on the light. */
inline Spectrum infinite_gather(Scene scene, vec3 side, vec3 d, real pdf, Wavelengths lambdas)
{
    Spectrum sum = spectrum_of(0.0f);
    for (int row = 0; row < scene.settings->infinite_count; row++) {
        Spectrum radiance;
        real other;
        infinite_light(scene, row, side, d, lambdas, &radiance, &other);
        sum = spectrum_madd(radiance, sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other)), sum);
    }
    return sum;
}
