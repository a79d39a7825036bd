/* The same radiance from every direction; sampled by the cosine to the normal of the side that matters,
 * evenly over the sphere where both do. */
Spectrum constant_radiance(Constant l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return emission_load(scene, l.radiance, texture_point_nowhere(), lambdas);
}

real constant_pdf(Constant l, Scene scene, vec3 side, vec3 d)
{
    return sel(light_sided(side), cosine_hemisphere_pdf(dot3(side, d)), (real)(INV_4PI));
}

LightSample constant_sample(Constant l, Scene scene, vec3 side, vec2 u, Wavelengths lambdas)
{
    vec3 w = cosine_hemisphere(u);
    LightSample s;
    s.wi = sel3(light_sided(side), to_world(frame_of(side), w), uniform_sphere(u));
    s.t = FAR;
    s.radiance = constant_radiance(l, scene, s.wi, lambdas);
    s.pdf = constant_pdf(l, scene, side, s.wi);
    return s;
}
