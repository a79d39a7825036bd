/* The ray with which a path begins at the camera, and its throughput. */
inline CameraRay first_ray(Scene scene, vec2 position, vec2 lens, Wavelengths lambdas, Spectrum *beta)
{
    *beta = camera_start();
    return camera_ray(scene, position, lens, lambdas);
}
