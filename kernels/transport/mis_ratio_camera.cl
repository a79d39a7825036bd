/* The mis_ratio of a camera's path at its first vertex, if light paths are connected to the camera. */
inline real mis_ratio_seen(Scene scene, Vertex v, Sampler sampler, real mis_ratio)
{
    CameraPoint c = camera_connect(scene, v.s.p, mask_of(0), sampler_pair(sampler, (natural)(DIMENSION_LENS)));
    return sel(c.seen, mis_ratio / max_r(c.importance * scene.settings->mis_area_unit, (real)(1e-30f)), (real)(0.0f));
}

/* Twin, without connections of light paths to the camera. */
inline real mis_ratio_seen(Scene scene, Vertex v, Sampler sampler, real mis_ratio) { return (real)(0.0f); }
