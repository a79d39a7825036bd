/* The ray with which a path begins at a camera that weighs its rays by wavelength, and its throughput. */
inline CameraRay first_ray(Scene scene, vec2 position, vec2 lens, Wavelengths lambdas, Spectrum *beta)
{
    Spectrum weight;
    CameraRay ray = camera_weighted_ray(scene, position, lens, lambdas, &weight);
    *beta = spectrum_mul(camera_start(), weight);
    return ray;
}
