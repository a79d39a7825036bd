/* The frame in which a surface is shaded, where nothing bends it. */
typedef struct { Frame frame; } Facing;

inline Facing facing_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    Facing f = {surface_frame(s)};
    return f;
}
inline real facing_share(Facing f, vec3 w) { return 1.0f; }
