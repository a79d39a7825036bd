/* Marble as pbrt has it: along y runs a sine, disturbed by noise, through a row of cubic Bezier curves
 * between nine colours, 1.5 times their brightness. */
#include "core/perlin_noise.cl"

/* The words of the two colours around the value, from word `first`, and the position between them. */
inline integer marble_at(Marble t, Scene scene, TexturePoint point, real *along)
{
    vec3 p = scale3(texture_transformed(scene, t.transform, point.p), t.scale);
    real turns = (p.y + t.variation * fractal_noise(scene, p, t.octaves, t.roughness, mask_of(0))) * INV_2PI, s, c;
    sincos_2pi(clamp_r(turns - floor(turns), (real)(0.0f), (real)(1.0f)), &s, &c);
    real x = (0.5f + 0.5f * s) * 6.0f;
    integer segment = min_i(max_i(to_integer(floor(x)), (integer)(0)), (integer)(5));
    *along = x - to_real(segment);
    return segment;
}
inline void marble_weights(real t, real *w)
{
    real s = 1.0f - t;
    w[0] = 1.5f * s * s * s;
    w[1] = 4.5f * s * s * t;
    w[2] = 4.5f * s * t * t;
    w[3] = 1.5f * t * t * t;
}

Spectrum marble_reflectance(Marble t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    real along, weights[4];
    integer segment = marble_at(t, scene, point, &along);
    marble_weights(along, weights);
    Spectrum sum = spectrum_of(0.0f);
    for (int i = 0; i < 4; i++) {
        vec4 colour = row4(scene.textures, t.colours + 5 * (segment + i));
        sum = spectrum_madd(spectrum_constant(colour, lambdas), weights[i], sum);
    }
    return sum;
}

Spectrum marble_emission(Marble t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_mul(marble_reflectance(t, scene, point, lambdas),
                        spectrum_grey_light(scene, (real)(1.0f), lambdas));
}

/* Its luminance: here the first of a colour's words is a number. */
real marble_real(Marble t, Scene scene, TexturePoint point)
{
    real along, weights[4], sum = 0.0f;
    integer segment = marble_at(t, scene, point, &along);
    marble_weights(along, weights);
    for (int i = 0; i < 4; i++) sum += weights[i] * gather_w(scene.textures, t.colours + 5 * (segment + i));
    return sum;
}
