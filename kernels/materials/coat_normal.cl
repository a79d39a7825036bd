/* A coat whose normal is told by a map of its own. */
/* The material, whose coat's normal is told by u and v of its map and the surface's normal, in the frame where it is
 * shaded. */
inline Bsdf coat_normal_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded)
{
    Frame base = surface_frame(s);
    real scale = m.clearcoat_normal_scale, x = (2.0f * m.clearcoat_normal_x - 1.0f) * scale;
    real y = (2.0f * m.clearcoat_normal_y - 1.0f) * scale;
    MapFrame own = shading_map_frame(scene, row, s, base, 1);
    vec3 n = map_frame_vector(own, v3(x, y, 2.0f * m.clearcoat_normal_z - 1.0f));
    n = to_frame(shaded, to_world(base, normalize3(n)));
    m.clearcoat_normal_x = 0.5f * n.x + 0.5f;
    m.clearcoat_normal_y = 0.5f * n.y + 0.5f;
    m.clearcoat_normal_z = 0.5f * n.z + 0.5f;
    m.clearcoat_normal_scale = 1.0f;
    return m;
}

/* Twin, where a material has no coat with a normal of its own. */
inline Bsdf coat_normal_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded) { return m; }
