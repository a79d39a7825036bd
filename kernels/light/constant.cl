/* The same radiance from every direction; sampled evenly over the sphere. */
Spectrum constant_radiance(Constant l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return emission_load(scene, l.radiance, texture_point_nowhere(), lambdas);
}

real constant_pdf(Constant l, Scene scene, vec3 d) { return INV_4PI; }

LightSample constant_sample(Constant l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    LightSample s;
    s.wi = uniform_sphere(u);
    s.t = FAR;
    s.radiance = constant_radiance(l, scene, s.wi, lambdas);
    s.pdf = INV_4PI;
    return s;
}
