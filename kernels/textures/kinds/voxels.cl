/* Values at the centres of the cells of a box, which is the unit cube of the texture's space: at (i + 1/2) / n along
 * each axis, as texels of textures/kinds/bitmap.cl. Between them the evaluated values are interpolated. */
typedef struct {
    integer at[3][2]; /* along x, y and z: two points, inside the grid */
    real weight[3][2];
} VoxelsCell;

inline VoxelsCell voxels_cell(Voxels t, Scene scene, TexturePoint point)
{
    vec3 p = texture_transformed(scene, t.transform, point.p);
    mask smooth = t.nearest == 0;
    VoxelsCell c;
    bitmap_axis(p.x, t.nx, t.wrap, smooth, &c.at[0][0], &c.at[0][1], &c.weight[0][0], &c.weight[0][1]);
    bitmap_axis(p.y, t.ny, t.wrap, smooth, &c.at[1][0], &c.at[1][1], &c.weight[1][0], &c.weight[1][1]);
    bitmap_axis(p.z, t.nz, t.wrap, smooth, &c.at[2][0], &c.at[2][1], &c.weight[2][0], &c.weight[2][1]);
    return c;
}

/* The index of one of the eight points, and its weight; the blank row, which has no points, has index 0. */
inline integer voxels_corner(Voxels t, VoxelsCell c, int corner, real *weight)
{
    int x = corner & 1, y = (corner >> 1) & 1, z = corner >> 2;
    *weight = c.weight[0][x] * c.weight[1][y] * c.weight[2][z];
    return max_i((c.at[2][z] * t.ny + c.at[1][y]) * t.nx + c.at[0][x], (integer)(0));
}

/* The value as a reflectance, or as light. */
inline Spectrum voxels_spectrum(Voxels t, Scene scene, TexturePoint point, Wavelengths lambdas, int light)
{
    VoxelsCell c = voxels_cell(t, scene, point);
    Spectrum sum = spectrum_of(0.0f);
    for (int corner = 0; corner < 8; corner++) {
        real weight;
        integer at = t.first + SPECTRUM_SIZE * voxels_corner(t, c, corner, &weight);
        if (!any(weight > 0.0f)) continue;
        Spectrum value = light ? spectrum_light_texel_at(scene, scene.images, at, lambdas)
                               : spectrum_texel_at(scene.images, at, lambdas);
        sum = spectrum_madd(value, weight, sum);
    }
    return sum;
}

Spectrum voxels_reflectance(Voxels t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return voxels_spectrum(t, scene, point, lambdas, 0);
}

Spectrum voxels_emission(Voxels t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return voxels_spectrum(t, scene, point, lambdas, 1);
}

real voxels_real(Voxels t, Scene scene, TexturePoint point)
{
    VoxelsCell c = voxels_cell(t, scene, point);
    real sum = 0.0f;
    for (int corner = 0; corner < 8; corner++) {
        real weight;
        integer at = t.first + voxels_corner(t, c, corner, &weight);
        if (!any(weight > 0.0f)) continue;
        sum += weight * gather_w(scene.images, at);
    }
    return sum;
}
