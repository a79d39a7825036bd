/* A coat whose normal is told by a map of its own. */
/* The material, whose coat's normal is told by the surface's u, v and normal, in the frame where it is shaded. */
inline Bsdf coat_normal_turned(Bsdf m, Surface s, Frame shaded)
{
    Frame own = surface_frame(s);
    real scale = m.clearcoat_normal_scale, x = (2.0f * m.clearcoat_normal_x - 1.0f) * scale;
    real y = (2.0f * m.clearcoat_normal_y - 1.0f) * scale;
    vec3 n = v3(x, sel(dot3(own.t, s.dpdv) < 0.0f, -y, y), 2.0f * m.clearcoat_normal_z - 1.0f);
    n = to_frame(shaded, to_world(own, normalize3(n)));
    m.clearcoat_normal_x = 0.5f * n.x + 0.5f;
    m.clearcoat_normal_y = 0.5f * n.y + 0.5f;
    m.clearcoat_normal_z = 0.5f * n.z + 0.5f;
    m.clearcoat_normal_scale = 1.0f;
    return m;
}
