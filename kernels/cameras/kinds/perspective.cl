/* A pinhole: every ray's line goes through the camera's origin. extent: of the film on the plane at distance 1;
 * offset: of its centre, in shares of it. */
CameraRay perspective_ray(global const PerspectiveCamera *camera, vec2 film, vec2 lens)
{
    vec3 d = normalize3(v3((0.5f - film.x - camera->offset[0]) * camera->extent[0],
                           (0.5f - film.y - camera->offset[1]) * camera->extent[1], (real)(1.0f)));
    real near = camera->near / d.z;
    CameraRay r;
    r.d = normalize3(matrix_vector(camera->to_world, d.x, d.y, d.z));
    r.o = matrix_point(camera->to_world, d.x * near, d.y * near, d.z * near);
    r.far = (camera->far - camera->near) / d.z;
    return r;
}

/* Step connect: a point as the pinhole sees it: see film/connect.cl. */
CameraPoint perspective_connect(global const PerspectiveCamera *camera, global const Settings *settings, vec3 p,
                                mask away, vec2 lens)
{
    vec2 middle = {0.0f, 0.0f};
    return pinhole_connect(settings, camera->to_world, camera->extent, camera->offset, camera->near, camera->far, 1.0f,
                           middle, p, away);
}

/* Step screen: where the pinhole sees a point. */
vec2 perspective_screen(global const PerspectiveCamera *camera, vec3 p, mask away, mask *seen)
{
    return pinhole_screen(camera->to_world, camera->extent, camera->offset, p, away, seen);
}
