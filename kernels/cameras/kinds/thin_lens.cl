/* A pinhole with a disk for an aperture (Cook et al. 1984): the plane at the focus distance is sharp. */

/* The ray along `d` through the point `p` of the lens, in camera space. */
inline CameraRay thin_lens_through(global const ThinLensCamera *camera, vec2 p, vec3 d)
{
    real near = camera->near / d.z;
    CameraRay r;
    r.d = normalize3(matrix_vector(camera->to_world, d.x, d.y, d.z));
    r.o = matrix_point(camera->to_world, p.x + d.x * near, p.y + d.y * near, d.z * near);
    r.far = (camera->far - camera->near) / d.z;
    return r;
}

inline vec2 thin_lens_point(global const ThinLensCamera *camera, vec2 lens)
{
    vec2 p = concentric_disk(lens);
    p.x *= camera->aperture_radius;
    p.y *= camera->aperture_radius;
    return p;
}

CameraRay thin_lens_ray(global const ThinLensCamera *camera, vec2 film, vec2 lens)
{
    real focus = camera->focus_distance;
    vec2 p = thin_lens_point(camera, lens);
    vec3 d = normalize3(v3((0.5f - film.x - camera->offset[0]) * camera->extent[0] * focus - p.x,
                           (0.5f - film.y - camera->offset[1]) * camera->extent[1] * focus - p.y, focus));
    return thin_lens_through(camera, p, d);
}

/* Where the glass disperses: the lens's power goes as n - 1 (the lensmaker's equation, Born and Wolf
 * 1999, 4.4.3), the film stays where it is, so the sharp plane moves: at s, 1 / s = 1 / focus_distance +
 * (power / design power - 1) / focal_length; not above 0 beyond infinity. index: n at the hero's wavelength. */
CameraRay thin_lens_glass_ray(global const ThinLensCamera *camera, vec2 film, vec2 lens, real index)
{
    vec2 p = thin_lens_point(camera, lens);
    real s = 1.0f / camera->focus_distance + ((index - 1.0f) / camera->power - 1.0f) / camera->focal_length;
    vec3 d = normalize3(v3((0.5f - film.x - camera->offset[0]) * camera->extent[0] - p.x * s,
                           (0.5f - film.y - camera->offset[1]) * camera->extent[1] - p.y * s, (real)(1.0f)));
    return thin_lens_through(camera, p, d);
}

/* Step connect: a point as a point of the aperture sees it: see film/connect.cl. A pixel gathers from all of the
 * aperture. */
CameraPoint thin_lens_connect(global const ThinLensCamera *camera, global const Settings *settings, vec3 p, mask away,
                              vec2 lens)
{
    vec2 q = thin_lens_point(camera, lens);
    return pinhole_connect(settings, camera->to_world, camera->extent, camera->offset, camera->near, camera->far,
                           camera->focus_distance, q, p, away);
}

/* Step screen: where the middle of the lens sees a point. */
vec2 thin_lens_screen(global const ThinLensCamera *camera, vec3 p, mask away, mask *seen)
{
    return pinhole_screen(camera->to_world, camera->extent, camera->offset, p, away, seen);
}
