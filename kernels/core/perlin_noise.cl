/* Perlin's noise (Improving Noise, 2002): gradients at whole coordinates, chosen by a permutation of 256
 * numbers that stands in `textures` from TEXTURE_PERMUTATION, with his polynomial of degree five between. */
inline integer noise_permuted(Scene scene, integer i)
{
    return gather_i(scene.textures, (i & 255) + TEXTURE_PERMUTATION);
}
inline real noise_gradient(Scene scene, integer x, integer y, integer z, real dx, real dy, real dz)
{
    integer h = noise_permuted(scene, noise_permuted(scene, noise_permuted(scene, x) + y) + z) & 15;
    mask last = (h == 12) | (h == 13);
    real u = sel((h < 8) | last, dx, dy), v = sel((h < 4) | last, dy, dz);
    return sel((h & 1) != 0, -u, u) + sel((h & 2) != 0, -v, v);
}
inline real noise_weight(real t) { return t * t * t * (10.0f + t * (6.0f * t - 15.0f)); }
/* The cell of a coordinate, 0 to 255 as the noise repeats, and the offset in it. */
inline integer noise_cell(real x, real *t)
{
    real below = floor(x);
    *t = x - below;
    return to_integer(clamp_r(below - 256.0f * floor(below * (1.0f / 256.0f)), (real)(0.0f), (real)(255.0f)));
}
inline real perlin_noise(Scene scene, vec3 p)
{
    real dx, dy, dz;
    integer x = noise_cell(p.x, &dx), y = noise_cell(p.y, &dy), z = noise_cell(p.z, &dz);
    real wx = noise_weight(dx), wy = noise_weight(dy), wz = noise_weight(dz), sum = 0.0f;
    ROLLED
    for (int corner = 0; corner < 8; corner++) {
        int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        real g = noise_gradient(scene, x + i, y + j, z + k, dx - (float)i, dy - (float)j, dz - (float)k);
        sum += g * (i ? wx : 1.0f - wx) * (j ? wy : 1.0f - wy) * (k ? wz : 1.0f - wz);
    }
    return sum;
}
/* The sum of octaves; folded: of their absolute values. */
inline real fractal_noise(Scene scene, vec3 p, integer octaves, real roughness, mask folded)
{
    real sum = 0.0f, strength = 1.0f;
    for (int i = 0; any((integer)(i) < octaves); i++) {
        real n = perlin_noise(scene, p);
        sum += sel((integer)(i) < octaves, strength * sel(folded, fabs(n), n), (real)(0.0f));
        p = scale3(p, 1.99f);
        strength *= roughness;
    }
    return sum;
}
