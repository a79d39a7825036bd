/* The wavelengths of a path as the film sees them; lambdas: those by which light comes, others where it fluoresces. */
inline Wavelengths seen_wavelengths(Scene scene, Slab path, uint at, Wavelengths lambdas)
{
    Sampler begun = pixel_sampler(scene.settings, load_path_pixel_key(path, at), load_path_sample(path, at));
    return wavelengths_sample(scene, sampler_pair(begun, (natural)(DIMENSION_WAVELENGTH)).x);
}

/* Twin, where nothing fluoresces. */
inline Wavelengths seen_wavelengths(Scene scene, Slab path, uint at, Wavelengths lambdas) { return lambdas; }
