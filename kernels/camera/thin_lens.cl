/* A pinhole with a disk for an aperture (Cook et al. 1984): the plane at the focus distance is sharp. */

/* The unit square onto the unit disk, rings to rings (Shirley and Chiu 1997). */
inline vec2 thin_lens_disk(vec2 u)
{
    real x = 2.0f * u.x - 1.0f, y = 2.0f * u.y - 1.0f;
    mask upright = fabs(x) < fabs(y);
    real r = sel(upright, y, x), turn = 0.125f * safe_div(sel(upright, x, y), r), s, c;
    turn = sel(upright, 0.25f - turn, turn);
    sincos_2pi(turn - floor(turn), &s, &c);
    vec2 p = {r * c, r * s};
    return p;
}

CameraRay thin_lens_ray(global const ThinLensCamera *camera, vec2 film, vec2 lens)
{
    real focus = camera->focus_distance;
    vec2 p = thin_lens_disk(lens);
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
