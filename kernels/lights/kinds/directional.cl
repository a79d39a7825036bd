/* Light from a disk at infinity that no ray meets; `direction` is the unit vector along the ray from its middle, and
 * `angle` its diameter [rad]. */
LightSample directional_sample(Directional l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    real a = sqr(0.5f * l.angle); /* the square of its half angle, at most pi / 2 */
    real high = 0.00138888889f - a * (2.48015873e-5f - a * 2.7557e-7f);
    real one_minus_cos = a * (0.5f - a * (0.0416666667f - a * high));
    Spectrum irradiance = emission_load(scene, l.irradiance, texture_point_nowhere(), lambdas);
    LightSample s;
    s.wi = neg3(l.direction);
    if (any(l.angle > 0.0f)) s.wi = to_world(frame_of(s.wi), uniform_cone(u, one_minus_cos));
    s.t = FAR;
    s.radiance = spectrum_scale(irradiance, 1.0f / (1.0f - 0.5f * one_minus_cos)); /* over the mean cosine */
    s.pdf = -1.0f;
    return s;
}
