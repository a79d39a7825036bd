/* Parallel light; `direction` is the unit vector in which it travels. */
LightSample directional_sample(Directional l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    vec2 uv = {0.0f, 0.0f};
    LightSample s;
    s.wi = neg3(l.direction);
    s.t = FAR;
    s.radiance = emission_load(scene, l.radiance, uv, lambdas);
    s.pdf = -1.0f;
    return s;
}
