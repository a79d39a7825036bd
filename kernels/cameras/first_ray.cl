/* The ray that a path begins with at the camera, and its throughput. */

/* Step. */
inline CameraRay first_ray(Scene scene, vec2 position, vec2 lens, Wavelengths lambdas, Spectrum *beta)
{
    *beta = camera_start();
    return camera_ray(scene, position, lens, lambdas);
}

/* Step weighted: for a camera that weighs its rays by wavelength. */
inline CameraRay first_ray(Scene scene, vec2 position, vec2 lens, Wavelengths lambdas, Spectrum *beta)
{
    Spectrum weight;
    CameraRay ray = camera_weighted_ray(scene, position, lens, lambdas, &weight);
    *beta = spectrum_mul(camera_start(), weight);
    return ray;
}

/* Step again: the throughput that a sample began with at a camera that weighs its rays: they are traced again. */
inline Spectrum path_start(Scene scene, Slab path, uint at, integer pixel_index, integer sample)
{
    return sample_begin(scene, path, at, mask_of(0), pixel_index, sample).beta;
}

/* Twin, where all rays count alike, or the film has no alpha. */
inline Spectrum path_start(Scene scene, Slab path, uint at, integer pixel_index, integer sample)
{
    return camera_start();
}
