/* The frame in which a surface is shaded, where no map perturbs it. */
typedef struct { Frame frame; } ShadingFrame;

inline ShadingFrame shading_frame_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    ShadingFrame f = {surface_frame(s)};
    return f;
}
/* What a coat's normals (which: 1) or directions of anisotropy (2) are along. */
inline MapFrame shading_map_frame(Scene scene, integer row, Surface s, Frame base, int which)
{
    vec4 plain = {1.0f, 0.0f, 0.0f, 1.0f};
    return map_frame_of(s, base, mask_of(0), plain);
}
inline mask shading_frame_turns(Scene scene, integer row) { return mask_of(0); }
inline real shading_frame_share(ShadingFrame f, vec3 w) { return 1.0f; }
