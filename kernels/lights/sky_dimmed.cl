/* What media around the camera and in bodies do to light from all around. */

/* Light that comes to the beginning of the paths' last rays, of what `light` is infinitely far away. */
inline Spectrum sky_dimmed(Scene scene, Slab path, uint at, mask seen, Wavelengths lambdas, Spectrum light)
{
#if USES_ABSORPTION
    integer medium = sel_i(seen, medium_left(load_path_medium(path, at)), (integer)(0));
    light = spectrum_mul(light, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
    return light;
}
