/* A point as one point of the aperture sees it: see film/connect.cl. A pixel gathers from all of the aperture. */
CameraPoint thin_lens_connect(global const ThinLensCamera *camera, global const Settings *settings, vec3 p, mask away,
                              vec2 lens)
{
    vec2 q = thin_lens_point(camera, lens);
    return pinhole_connect(settings, camera->to_world, camera->extent, camera->offset, camera->near, camera->far,
                           camera->focus_distance, q, p, away);
}
