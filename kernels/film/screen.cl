/* Where on the film a point is, for the functions <kind>_screen of cameras: see cameras/camera.cl. */

/* A vector of the world in the camera's space: by the inverse of the first three columns of a matrix. */
inline vec3 screen_back(global const float *m, vec3 v)
{
    vec3 x = v3((real)(m[0]), (real)(m[4]), (real)(m[8])), y = v3((real)(m[1]), (real)(m[5]), (real)(m[9]));
    vec3 z = v3((real)(m[2]), (real)(m[6]), (real)(m[10])), yz = cross3(y, z);
    vec3 back = v3(dot3(yz, v), dot3(cross3(z, x), v), dot3(cross3(x, y), v));
    return scale3(back, 1.0f / dot3(x, yz));
}

inline vec3 screen_point_back(global const float *m, vec3 p)
{
    return screen_back(m, sub3(p, v3((real)(m[3]), (real)(m[7]), (real)(m[11]))));
}

/* A pinhole. */
inline vec2 pinhole_screen(global const float *m, global const float *extent, global const float *offset, vec3 p,
                           mask away, mask *seen)
{
    vec3 d = sel3(away, screen_back(m, p), screen_point_back(m, p));
    *seen = *seen & (d.z > 1e-6f);
    real z = sel(d.z > 1e-6f, d.z, (real)(1.0f));
    vec2 film = {0.5f - offset[0] - d.x / (z * extent[0]), 0.5f - offset[1] - d.y / (z * extent[1])};
    return film;
}
