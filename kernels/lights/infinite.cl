/* Light of infinite lights, for paths that leave the scene. */
#include "generated/infinite_weight.cl"

/* What one infinite light sends to a path that leaves the scene along d [W m^-2 sr^-1 nm^-1], and the share `w` of it
 * that counts. The direction was chosen with `pdf` [1/sr] (below 0: delta) at a point p of a surface that sends light
 * as `receiver` says, see lights/light.cl; the power heuristic weighs that against its choice on the light (Veach
 * 1997, 9.2.4), and, by the path's `mis_ratio`, against paths from the light (transport/mis_ratio.cl). */
inline Spectrum infinite_met(Scene scene, int row, vec3 p, Receiver receiver, vec3 d, real pdf, real mis_ratio,
                             Wavelengths lambdas, real *w)
{
    Spectrum radiance;
    real other;
    infinite_light(scene, row, p, receiver, d, lambdas, &radiance, &other);
    *w = infinite_weight(scene, row, p, d, pdf, other, mis_ratio);
    return radiance;
}

/* What all of them add. */
inline Spectrum infinite_gather(Scene scene, vec3 p, Receiver receiver, vec3 d, real pdf, real mis_ratio,
                                Wavelengths lambdas)
{
    Spectrum sum = spectrum_of(0.0f);
    for (int row = 0; row < scene.settings->infinite_count; row++) {
        real w;
        Spectrum radiance = infinite_met(scene, row, p, receiver, d, pdf, mis_ratio, lambdas, &w);
        sum = spectrum_madd(radiance, w, sum);
    }
    return sum;
}
