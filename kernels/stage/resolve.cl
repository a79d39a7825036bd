/* From a film (r g b linear, samples) to a picture for a screen or a program: exposure, a tone curve,
 * the sRGB transfer (IEC 61966-2-1), opaque alpha. NaN is black. Codes of 8 bits come from a table of
 * the least linear value of each, clpt.images.colour.srgb8_steps, so they are those of a written .png to the bit.
 * With a table of a display's codes (`size` points on an axis, else 0) these take the place of curve and
 * transfer. */
#include "film/tone.cl"
#include "film/tone.cl"

/* The colour of a pixel in linear Rec. 709; rows: of the matrix to it, used where `converted`. */
inline float4 exposed(float4 v, int converted, float4 red, float4 green, float4 blue, float scale)
{
    v.w = 0.0f;
    if (converted) v = (float4)(dot(red, v), dot(green, v), dot(blue, v), 0.0f);
    v = select(v, (float4)(0.0f), isnan(v)) * scale;
    return select(v, (float4)(0.0f), isnan(v)); /* infinity times 0 */
}

inline float4 shown(float4 v, int tone, global const float4 *table, int size, float4 bounds)
{
    v = size ? clamp(table_colour(table, size, bounds, v), 0.0f, 1.0f) : tone_curve(v, tone);
    return select(v, (float4)(0.0f), isnan(v));
}

inline float srgb_transfer(float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * pow(v, 1.0f / 2.4f) - 0.055f; }

/* The codes of a colour: near codes, by a fit to the transfer that is right to 0.1 of a code (minimax over
 * [0.0031308, 1], our own), then by the steps of a code and the next code; these go from -inf to inf. */
inline uint4 srgb_codes(global const float *steps, float4 v)
{
    v = clamp(v, 0.0f, 1.0f);
    float4 root = sqrt(v), shown = 0.833733f * root + 0.298129f * sqrt(root) - 0.0553134f * v - 0.0769088f;
    shown = select(shown, 12.92f * v, v <= 0.0031308f);
    int4 code = convert_int4(shown * 255.0f + 0.5f);
    code.x += (v.x >= steps[code.x + 1]) - (v.x < steps[code.x]);
    code.y += (v.y >= steps[code.y + 1]) - (v.y < steps[code.y]);
    code.z += (v.z >= steps[code.z + 1]) - (v.z < steps[code.z]);
    return as_uint4(code);
}

inline uchar4 as_bytes(float4 v, global const float *steps, int encoded)
{
    uint4 code = encoded ? srgb_codes(steps, v) : convert_uint4_sat_rte(v * 255.0f);
    code.w = 255;
    return convert_uchar4_sat(code);
}

inline float4 as_floats(float4 v, int encoded)
{
    if (encoded) v = (float4)(srgb_transfer(v.x), srgb_transfer(v.y), srgb_transfer(v.z), 1.0f);
    v.w = 1.0f;
    return v;
}

#define PICTURE_ARGS                                                                                            \
    global const float4 *film, global const float *steps, int converted, float4 red, float4 green, float4 blue, \
    float scale, int tone, global const float4 *table, int size, float4 bounds, int encoded, int flip,          \
    int width, int height
#define PICTURE_PIXEL                                                                    \
    int x = get_global_id(0), y = get_global_id(1);                                      \
    if (x >= width || y >= height) return;                                               \
    int row = flip ? height - 1 - y : y;                                                 \
    float4 v = exposed(film[(size_t)y * width + x], converted, red, green, blue, scale); \
    v = shown(v, tone, table, size, bounds)

/* at: where the picture begins in `into` [elements]. */
kernel void resolve_bytes(PICTURE_ARGS, global uchar *into, ulong at)
{
    PICTURE_PIXEL;
    vstore4(as_bytes(v, steps, encoded), (size_t)row * width + x, into + at);
}

kernel void resolve_floats(PICTURE_ARGS, global float *into, ulong at)
{
    PICTURE_PIXEL;
    vstore4(as_floats(v, encoded), (size_t)row * width + x, into + at);
}

#ifdef __IMAGE_SUPPORT__
kernel void resolve_byte_image(PICTURE_ARGS, write_only image2d_t into)
{
    PICTURE_PIXEL;
    write_imagef(into, (int2)(x, row), convert_float4(as_bytes(v, steps, encoded)) / 255.0f);
}

kernel void resolve_float_image(PICTURE_ARGS, write_only image2d_t into)
{
    PICTURE_PIXEL;
    write_imagef(into, (int2)(x, row), as_floats(v, encoded));
}
#endif
