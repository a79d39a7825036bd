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
