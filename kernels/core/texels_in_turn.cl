/* The function of core/texels_between.cl, texel by texel: four spectra at once need too many of a GPU's registers. */
inline Spectrum texels_between(Scene scene, integer first, integer i00, integer i10, integer i01, integer i11, vec2 at,
                               Wavelengths lambdas)
{
    Spectrum sum = spectrum_of((real)(0.0f));
    ROLLED
    for (int k = 0; k < 4; k++) {
        integer i = k & 2 ? (k & 1 ? i11 : i01) : (k & 1 ? i10 : i00);
        real share = (k & 1 ? at.x : 1.0f - at.x) * (k & 2 ? at.y : 1.0f - at.y);
        sum = spectrum_madd(texel_at(scene, first, i, lambdas), share, sum);
    }
    return sum;
}
