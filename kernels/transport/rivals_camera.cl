/* The rival of a camera's path at its first vertex, where light paths are joined to the camera
 * (transport/rivals.cl). */
inline real rival_seen(Scene scene, Vertex v, Sampler sampler, real rival)
{
    CameraPoint c = camera_connect(scene, v.s.p, mask_of(0), sampler_pair(sampler, (natural)(DIMENSION_LENS)));
    return sel(c.seen, rival / max_r(c.importance * scene.settings->rival_area, (real)(1e-30f)), (real)(0.0f));
}

/* Twin, where no light path is joined to the camera. */
#define rival_seen(scene, v, sampler, rival) ((real)(0.0f))
