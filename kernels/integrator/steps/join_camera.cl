/* Connects a vertex of a light path to the camera; the ray to the camera waits in the shadow slab. */
typedef struct {
    CameraPoint c;
    vec3 to; /* toward the point of the lens, in shading.frame */
} CameraJoint;

/* Step. */

/* Samples a point of the lens. */
inline CameraJoint join_camera_seek(Scene scene, Vertex v, Scattering scatter)
{
    CameraJoint joint;
    vec2 lens = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_LIGHT);
    joint.c = camera_connect(scene, v.s.p, mask_of(0), lens);
    joint.to = to_frame(scatter.shading.frame, neg3(joint.c.d));
    return joint;
}

/* Returns the bits to add to Path.state. arrives: 1 over the cosine of the incident ray. */
inline integer join_camera(Scene scene, Slab shadow, uint at, mask active, Vertex v, Scattering scatter,
                           MisRatio mis_ratio, CameraJoint joint, real arrives)
{
    CameraPoint c = joint.c;
    real length, cosine = VERTEX_COSINE(v.s.n, c.d);
    if (LANES == 1) length = connect_camera(shadow, at, active & c.seen, v.s, c); /* later it costs registers */
    BsdfPair pair = bsdf_pair(scatter.bsdf, joint.to, scatter.wo, spectrum_of(1.0f));
    mask shine = active & c.seen & (spectrum_max(pair.f) > 0.0f);
    real share = shading_frame_share(scatter.shading, neg3(v.d));
    real carries = cosine * arrives * c.importance * share;
    carries *= mis_weight_of_connection(scene, mis_ratio, v, pair, c, &shine);
    Spectrum value = spectrum_scale(spectrum_mul(v.beta, pair.f), carries);
    value = vertex_beyond(scene, v, neg3(c.d), c.t, v.lambdas, value);
    if (LANES > 1) length = connect_camera(shadow, at, shine, v.s, c);
    store_shadow_t(shadow, at, active, sel(shine, length, (real)(-1.0f)));
    store_shadow_value(shadow, at, LANES == 1 ? active : shine, value);
    store_shadow_through(shadow, at, shine, vertex_through(v, neg3(c.d)));
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}

/* Twin, where light paths leave photons alone, or a material sends light in a single direction. */
inline CameraJoint join_camera_seek(Scene scene, Vertex v, Scattering scatter)
{
    CameraJoint joint;
    joint.to = scatter.wo;
    return joint;
}
inline integer join_camera(Scene scene, Slab shadow, uint at, mask active, Vertex v, Scattering scatter,
                           MisRatio mis_ratio, CameraJoint joint, real arrives) { return (integer)(0); }
