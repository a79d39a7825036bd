/* A point with an image sends its rays evenly; their power follows the image: `goniometric_intensity` stands in
 * lights/kinds/goniometric.cl. */
LightRay goniometric_emit(Goniometric l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    LightRay r = light_ray_nothing();
    r.o = l.position;
    r.d = uniform_sphere(v);
    r.n = r.d;
    r.power = spectrum_scale(goniometric_intensity(l, scene, r.d, lambdas), 4.0f * PI);
    return r;
}

real goniometric_emit_pdf(Goniometric l, vec3 d) { return INV_4PI; }
