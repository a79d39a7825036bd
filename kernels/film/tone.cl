/* Tone curves: from linear Rec. 709 of any brightness to the linear light of a screen, white is 1. The host has the
 * same curves, clpt/images/colour.py, with names in the order of these numbers.
 *
 * Reinhard: Reinhard et al. 2002, "Photographic Tone Reproduction", eq. 3, of the luminance of Rec. 709.
 * Aces: the rational fit to the curve of ACES by Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
 * AgX: Sobotka 2022; Neutral: Khronos 2024, "PBR Neutral Tone Mapper". */
#define TONE_REINHARD 1
#define TONE_ACES 2
#define TONE_AGX 3
#define TONE_NEUTRAL 4
#define LARGEST 1e18f /* its square is finite */

/* The sigmoid of AgX: slope 2 through (pivot, 1/2), and 0 and 1 at the ends of [0, 1]. */
inline float4 agx_curve(float4 x)
{
    const float pivot = 10.0f / 16.5f;
    float4 away = x - pivot, far = fabs(away);
    float4 below = powr(1.0f + 59.507875f * far * far * far, (float4)(-1.0f / 3.0f));
    float4 above = powr(1.0f + 69.862789f * powr(far, (float4)(3.25f)), (float4)(-1.0f / 3.25f));
    return 0.5f + 2.0f * away * select(above, below, away < 0.0f);
}

inline float4 agx(float4 c)
{
    const float4 weights = (float4)(0.04240107f, 0.0784365f, 0.07916243f, 0.0f); /* of grey: a fifth */
    float4 stops = log2(fmax(0.8f * c + dot(weights, c), 1e-10f) * (1.0f / 0.18f));
    float4 v = agx_curve(clamp((stops + 10.0f) * (1.0f / 16.5f), 0.0f, 1.0f));
    v = (v - dot(weights, v)) * (1.0f / 0.8f);
    return powr(clamp(v, 0.0f, 1.0f), (float4)(2.2f));
}

inline float4 neutral(float4 c)
{
    const float f90 = 0.04f, start = 0.76f, d = 0.24f;
    float least = fmin(c.x, fmin(c.y, c.z));
    c -= least < 2.0f * f90 ? least - least * least / (4.0f * f90) : f90;
    float peak = fmax(c.x, fmax(c.y, c.z));
    if (peak < start) return c;
    float lowered = 1.0f - d * d / (peak + d - start);
    float white = 1.0f - 1.0f / (0.15f * (peak - lowered) + 1.0f);
    return mix(c * (lowered / peak), (float4)(lowered), white);
}

inline float4 tone_curve(float4 c, int tone)
{
    if (tone == 0) return c;
    c = clamp(c, 0.0f, LARGEST);
    if (tone == TONE_REINHARD) return c / (1.0f + 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z);
    if (tone == TONE_AGX) return agx(c);
    if (tone == TONE_NEUTRAL) return neutral(c);
    return clamp(c * (2.51f * c + 0.03f) / (c * (2.43f * c + 0.59f) + 0.14f), 0.0f, 1.0f);
}

/* A table of colours over a cube of linear Rec. 709, as clpt/images/colour.py bakes it: red changes first.
 * Each axis is asinh(v / NEAR) from LOWEST to HIGHEST; between points the tetrahedron that holds a colour
 * decides (Kasson et al. 1993, "Tetrahedral interpolation technique for color space conversion"). */
/* The position of a colour on the axes of a table, in [0, 1]; bounds: asinh at their ends, and NEAR. */
inline float4 table_place(float4 c, float4 bounds)
{
    return clamp((asinh(c / bounds.z) - bounds.x) / (bounds.y - bounds.x), 0.0f, 1.0f);
}

inline float4 table_colour(global const float4 *table, int size, float4 bounds, float4 c)
{
    float4 at = table_place(c, bounds) * (float)(size - 1);
    int4 cell = min(convert_int4(at), size - 2);
    float4 f = at - convert_float4(cell);
    int3 steps = (int3)(1, size, size * size);
    int first = cell.x + cell.y * steps.y + cell.z * steps.z;
    /* the axes by how far the colour is along them: the path over the edges of its tetrahedron */
    int longest = f.x >= f.y ? (f.x >= f.z ? 0 : 2) : (f.y >= f.z ? 1 : 2);
    int shortest = f.z <= f.y ? (f.z <= f.x ? 2 : 0) : (f.y <= f.x ? 1 : 0);
    if (longest == shortest) shortest = longest == 2 ? 0 : 2; /* all are equal */
    float high = fmax(f.x, fmax(f.y, f.z)), low = fmin(f.x, fmin(f.y, f.z)), middle = f.x + f.y + f.z - high - low;
    int to_long = longest == 0 ? steps.x : longest == 1 ? steps.y : steps.z;
    int to_short = shortest == 0 ? steps.x : shortest == 1 ? steps.y : steps.z;
    int last = first + steps.x + steps.y + steps.z;
    return (1.0f - high) * table[first] + (high - middle) * table[first + to_long] +
           (middle - low) * table[last - to_short] + low * table[last];
}
