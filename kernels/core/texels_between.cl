/* Radiance between four texels, whose numbers are i00 to i11; at: in the square between them. */
inline Spectrum texels_between(Scene scene, integer first, integer i00, integer i10, integer i01, integer i11, vec2 at,
                               Wavelengths lambdas)
{
    Spectrum sum = spectrum_scale(texel_at(scene, first, i00, lambdas), (1.0f - at.x) * (1.0f - at.y));
    sum = spectrum_madd(texel_at(scene, first, i10, lambdas), at.x * (1.0f - at.y), sum);
    sum = spectrum_madd(texel_at(scene, first, i01, lambdas), (1.0f - at.x) * at.y, sum);
    return spectrum_madd(texel_at(scene, first, i11, lambdas), at.x * at.y, sum);
}
