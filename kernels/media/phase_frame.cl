/* The shading frame of a point in a medium: z points against the ray. */
typedef struct { Frame frame; } ShadingFrame;

inline ShadingFrame shading_frame_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    ShadingFrame f = {frame_of(neg3(d))};
    return f;
}
inline mask shading_frame_turns(Scene scene, integer row) { return mask_of(0); }
inline real shading_frame_share(ShadingFrame f, vec3 w) { return 1.0f; }
