/* Stands for media/aim_cone.cl where no lamp near which flights end shines into a cone. */
#define AIM_COUNT MEDIUM_AIMS

inline AimSpan aim_span(Scene scene, integer row, vec3 d, vec3 to, real delta, real far2, real end)
{
    AimSpan s = {(real)(0.0f), end, mask_of(1)};
    return s;
}
