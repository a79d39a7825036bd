/* Parallel light; `direction` is the unit vector along its rays. */
LightSample directional_sample(Directional l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    LightSample s;
    s.wi = neg3(l.direction);
    s.t = FAR;
    s.radiance = emission_load(scene, l.irradiance, texture_point_nowhere(), lambdas);
    s.pdf = -1.0f;
    return s;
}
