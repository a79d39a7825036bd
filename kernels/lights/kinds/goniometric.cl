/* A point whose intensity is that of an image in latitude and longitude, its directions as in
 * lights/kinds/envmap.cl, its texels' centres off the poles as in textures/kinds/bitmap.cl. Irradiance falls with the
 * square of the distance. */
inline Spectrum goniometric_intensity(Goniometric l, Scene scene, vec3 d, Wavelengths lambdas)
{
    real x = dot3(d, l.x), y = dot3(d, l.y), z = dot3(d, l.z);
    real turn = atan2_r(x, -z) * INV_2PI;
    vec2 uv = {turn + sel(turn < 0.0f, (real)(1.0f), (real)(0.0f)), 1.0f - atan2_r(sqrt(x * x + z * z), y) * INV_PI};
    TexturePoint point = texture_point(uv, l.position);
    Spectrum value = emission_load(scene, l.radiance, point, lambdas);
    return spectrum_scale(spectrum_mul(value, factor_load(scene, l.factor, point, lambdas)), l.scale);
}

LightSample goniometric_sample(Goniometric l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    real t2;
    LightSample s = light_toward(l.position, p, &t2);
    s.radiance = spectrum_scale(goniometric_intensity(l, scene, neg3(s.wi), lambdas), 1.0f / t2);
    s.pdf = -1.0f;
    return s;
}

/* Step emission: a point with an image sends its rays evenly; their power follows the image. */
LightRay goniometric_emit(Goniometric l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    LightRay r = light_ray_along(l.position, uniform_sphere(v));
    r.power = spectrum_scale(goniometric_intensity(l, scene, r.d, lambdas), 4.0f * PI);
    return r;
}

real goniometric_emit_pdf(Goniometric l, vec3 d) { return INV_4PI; }
