/* A material that is rougher along a direction, which is told beside u and v of a map. */
/* The material, whose direction is counted in the frame where it is shaded, from the first axis to the second. The
 * material tells it on the surface itself, from u to v, which is the other way round where uv are mirrored, and on a
 * back. */
inline Bsdf anisotropy_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded)
{
    Frame base = surface_frame(s);
    MapFrame own = shading_map_frame(scene, row, s, base, 2);
    real sine, cosine, turns = m.anisotropy_rotation * (1.0f / 360.0f);
    sincos_2pi(turns - floor(turns), &sine, &cosine);
    vec3 along = to_world(base, map_frame_vector(own, v3(cosine, sine, (real)(0.0f))));
    m.anisotropy_rotation = 360.0f * INV_2PI * atan2_r(dot3(along, shaded.t), dot3(along, shaded.s));
    return m;
}

/* Twin, where a material is equally rough in all directions, or knows no turn. */
inline Bsdf anisotropy_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded) { return m; }
