/* Levels of an image: itself, then copies of half the size each. The footprint tells the level with texels of its size
 * (Williams 1983, "Pyramidal Parametrics"); values are interpolated between two levels. */
typedef struct {
    integer level; /* the finer level */
    real coarser;  /* weight of the next level, which may be missing for 0 */
} MipLevels;

/* to_u, to_v: from uv to the image; texels: width times height. A uv by a mapping of points, or a mesh's second uv, has
 * no known footprint. */
inline MipLevels mip_levels(TexturePoint point, vec3 to_u, vec3 to_v, integer mapping, real texels, integer levels)
{
    real density = sqrt(fabs(to_u.x * to_v.y - to_u.y * to_v.x) * texels);
    real across = sel(mapping == MAPPING_UV, point.footprint * density, (real)(0.0f));
    real most = to_real(max_i(levels - 1, (integer)(0)));
    real detail = clamp_r(log2_r(max_r(across, (real)(1.0f))), (real)(0.0f), most), below = floor(detail);
    return (MipLevels){to_integer(below), detail - below};
}

/* A random level of both, with its weight as its chance; u: uniform, and so again afterwards. */
inline integer mip_random(MipLevels found, real *u)
{
    mask next = *u < found.coarser;
    *u = sel(next, safe_div(*u, found.coarser), (*u - found.coarser) / (1.0f - found.coarser));
    return found.level + sel_i(next, (integer)(1), (integer)(0));
}

/* The image at a level. */
inline Bitmap mip_level(Bitmap image, Scene scene, integer table, integer level)
{
    mask smaller = level > 0;
    if (!any(smaller)) return image;
    integer at = sel_i(smaller, table + 3 * level, (integer)(0));
    image.first = sel_i(smaller, gather_i(scene.textures, at), image.first);
    image.width = sel_i(smaller, gather_i(scene.textures, at + 1), image.width);
    image.height = sel_i(smaller, gather_i(scene.textures, at + 2), image.height);
    return image;
}
