/* A point as the pinhole sees it: see film/connect.cl. */
CameraPoint perspective_connect(global const PerspectiveCamera *camera, global const Settings *settings, vec3 p,
                                mask away, vec2 lens)
{
    vec2 middle = {0.0f, 0.0f};
    return pinhole_connect(settings, camera->to_world, camera->extent, camera->offset, camera->near, camera->far, 1.0f,
                           middle, p, away);
}
