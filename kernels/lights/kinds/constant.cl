/* The same radiance from every direction; sampled by the cosine to `hemisphere`, or evenly over the sphere where
 * `hemisphere` is 0. */
Spectrum constant_radiance(Constant l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return emission_load(scene, l.radiance, texture_point_nowhere(), lambdas);
}

real constant_pdf(Constant l, Scene scene, vec3 hemisphere, vec3 d)
{
    return sel(hemisphere_given(hemisphere), cosine_hemisphere_pdf(dot3(hemisphere, d)), (real)(INV_4PI));
}

LightSample constant_sample(Constant l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    vec3 w = cosine_hemisphere(u);
    LightSample s;
    s.wi = sel3(hemisphere_given(hemisphere), to_world(frame_of(hemisphere), w), uniform_sphere(u));
    s.t = FAR;
    s.radiance = constant_radiance(l, scene, s.wi, lambdas);
    s.pdf = constant_pdf(l, scene, hemisphere, s.wi);
    return s;
}
