/* A pinhole with a disk for an aperture (Cook et al. 1984): the plane at the focus distance is sharp. */

CameraRay thin_lens_ray(global const ThinLensCamera *camera, vec2 film, vec2 lens)
{
    real focus = camera->focus_distance;
    vec2 p = concentric_disk(lens);
    p.x *= camera->aperture_radius;
    p.y *= camera->aperture_radius;
    vec3 d = normalize3(v3((0.5f - film.x - camera->offset[0]) * camera->extent[0] * focus - p.x,
                           (0.5f - film.y - camera->offset[1]) * camera->extent[1] * focus - p.y, focus));
    real near = camera->near / d.z;
    CameraRay r;
    r.d = normalize3(matrix_vector(camera->to_world, d.x, d.y, d.z));
    r.o = matrix_point(camera->to_world, p.x + d.x * near, p.y + d.y * near, d.z * near);
    r.far = (camera->far - camera->near) / d.z;
    return r;
}
