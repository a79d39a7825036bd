/* From a film (r g b linear, samples) to a picture for a screen or a program: exposure, a tone curve,
 * the sRGB transfer (IEC 61966-2-1), opaque alpha. NaN is black. Codes of 8 bits are found in a table of
 * the least linear value of each, clpt.images.srgb8_steps, so they are those of a written .png to the bit.
 *
 * Reinhard: Reinhard et al. 2002, "Photographic Tone Reproduction", eq. 3, of the luminance of Rec. 709.
 * Aces: the rational fit to the curve of ACES by Narkowicz 2015, "ACES Filmic Tone Mapping Curve". */
#define TONE_REINHARD 1
#define TONE_ACES 2
#define LARGEST 1e18f /* its square is finite */

inline float4 tone_curve(float4 c, int tone)
{
    if (tone == 0) return c;
    c = clamp(c, 0.0f, LARGEST);
    if (tone == TONE_REINHARD) return c / (1.0f + 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z);
    return clamp(c * (2.51f * c + 0.03f) / (c * (2.43f * c + 0.59f) + 0.14f), 0.0f, 1.0f);
}

/* The colour of a pixel; rows: of the matrix to Rec. 709, used where `converted`. */
inline float4 shown(float4 v, int converted, float4 red, float4 green, float4 blue, float scale, int tone)
{
    v.w = 0.0f;
    if (converted) v = (float4)(dot(red, v), dot(green, v), dot(blue, v), 0.0f);
    v = tone_curve(select(v, (float4)(0.0f), isnan(v)) * scale, tone);
    return select(v, (float4)(0.0f), isnan(v)); /* infinity times 0 */
}

/* How many of the steps a value has reached: its 8-bit code. */
inline uchar srgb_code(global const float *steps, float v)
{
    int code = 0;
    for (int step = 128; step > 0; step >>= 1) code += v >= steps[code + step - 1] ? step : 0;
    return (uchar)code;
}

inline float srgb_transfer(float v)
{
    return v <= 0.0031308f ? 12.92f * v : 1.055f * pow(v, 1.0f / 2.4f) - 0.055f;
}

inline uchar4 as_bytes(float4 v, global const float *steps, int encoded)
{
    if (!encoded) return (uchar4)(convert_uchar3_sat_rte(v.xyz * 255.0f), 255);
    return (uchar4)(srgb_code(steps, v.x), srgb_code(steps, v.y), srgb_code(steps, v.z), 255);
}

inline float4 as_floats(float4 v, int encoded)
{
    if (encoded) v = (float4)(srgb_transfer(v.x), srgb_transfer(v.y), srgb_transfer(v.z), 1.0f);
    v.w = 1.0f;
    return v;
}

#define PICTURE_ARGS \
    global const float4 *film, global const float *steps, int converted, float4 red, float4 green, float4 blue, \
    float scale, int tone, int encoded, int flip
#define PICTURE_PIXEL \
    int x = get_global_id(0), y = get_global_id(1), w = get_global_size(0), h = get_global_size(1); \
    int row = flip ? h - 1 - y : y; \
    float4 v = shown(film[(size_t)y * w + x], converted, red, green, blue, scale, tone)

/* at: where the picture begins in `into` [elements]. */
kernel void resolve_bytes(PICTURE_ARGS, global uchar *into, ulong at)
{
    PICTURE_PIXEL;
    vstore4(as_bytes(v, steps, encoded), (size_t)row * w + x, into + at);
}

kernel void resolve_floats(PICTURE_ARGS, global float *into, ulong at)
{
    PICTURE_PIXEL;
    vstore4(as_floats(v, encoded), (size_t)row * w + x, into + at);
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
