/* Items of a build: boxes with a name.
 *
 * Items are float8: low corner, name, negated high corner, surface area of the content; so the union of two
 * boxes is a minimum. An item's name is its index with BVH_ITEM set, which keeps the
 * bits away from denormals and NaN.
 */
#define BVH_ITEM 0x40000000u

/* Consecutive items, and their node. */
typedef struct { uint node, first, count, depth; } Range;

/* A range's bounds, and its span: the minimum of (centroid, -centroid). */
typedef struct { float8 bounds, span; } Extent;

inline float8 item_union(float8 a, float8 b) { return a < b ? a : b; }

/* Twice the centroid, and its negation; the fourth lanes are unused. */
inline float8 item_centroid(float8 item) { float4 c = item.lo - item.hi; return (float8)(c, -c); }

inline Extent extent_empty(void) { Extent h = {(float8)(INFINITY), (float8)(INFINITY)}; return h; }

inline Extent extent_add(Extent h, float8 item)
{
    h.bounds = item_union(h.bounds, item);
    h.span = item_union(h.span, item_centroid(item));
    return h;
}

inline float item_half_area(float8 bounds)
{
    float4 e = -bounds.hi - bounds.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

inline float8 item_make(float4 lo, float4 hi, uint index, float area)
{
    lo.w = as_float(BVH_ITEM | index);
    hi.w = -area;
    return (float8)(lo, -hi);
}

inline uint item_index(float8 item) { return as_uint(item.s3) & ~BVH_ITEM; }
