/* Puts rays from points of lights to the camera, which sees lights, into the shadow slab. Returns the bits of
 * Path.state that follow. */
inline integer light_joined(Scene scene, Slab shadow, uint at, mask ended, mask go, Sampler sampler, Surface s,
                            LightRay r, Wavelengths lambdas)
{
    global const Settings *settings = scene.settings;
    vec2 lens = sampler_pair(sampler, (natural)(DIMENSION_VERTEX + DIMENSION_LIGHT));
    CameraPoint c = camera_connect(scene, sel3(r.away, neg3(r.d), r.o), r.away, lens);
    real cosine = sel(r.away, (real)(1.0f), -dot3(r.n, c.d));
    mask seen = go & c.seen & (cosine > 0.0f) & (spectrum_max(r.seen) > 0.0f);
    mask shine = seen & mask_of(settings->hide_lights == 0);
    integer lit = sel_i(go, r.row, (integer)(0)), medium = sel_i(go, light_medium(scene, lit), (integer)(0));
    /* A ray from infinity is traced from the camera. */
    store_shadow_through(shadow, at, shine, sel_i(r.away, camera_through(scene), light_through(scene, lit)));
    r.seen = medium_dims(scene, medium, c.t, lambdas, r.seen);
    connect_camera(shadow, at, ended, shine, s, c, spectrum_scale(r.seen, cosine * c.importance));
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, where light paths do not show lights to the camera. */
inline integer light_joined(Scene scene, Slab shadow, uint at, mask ended, mask go, Sampler sampler, Surface s,
                            LightRay r, Wavelengths lambdas) { return (integer)(0); }
