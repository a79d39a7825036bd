/* A table of colours over a cube of linear Rec. 709, as clpt/images/colour.py bakes it: red changes first.
 * Each axis is asinh(v / NEAR) from LOWEST to HIGHEST; between points the tetrahedron that holds a colour
 * decides (Kasson et al. 1993, "Tetrahedral interpolation technique for color space conversion"). */

/* Where a colour stands on the axes of a table, in [0, 1]; bounds: asinh at their ends, and NEAR. */
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
