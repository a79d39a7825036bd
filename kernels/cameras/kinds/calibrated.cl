/* Directions that a model of distortion gives the corners of pixels, bilinear between them. A pixel with a corner of
 * direction 0 is not seen. What lies beyond the film's edges goes on as the last pixel does. */
CameraRay calibrated_ray(Scene scene, global const CalibratedCamera *camera, vec2 film, vec2 lens, Wavelengths lambdas,
                         Spectrum *weight)
{
    real x = film.x * (float)camera->columns, y = film.y * (float)camera->rows, zero = 0.0f;
    integer column = clamp_i(to_integer(x), (integer)(camera->columns - 1));
    integer row = clamp_i(to_integer(y), (integer)(camera->rows - 1));
    integer below = 3 * (camera->columns + 1), word = camera->directions + row * below + 3 * column;
    vec3 a = gather3(scene.camera, word), b = gather3(scene.camera, word + 3);
    vec3 c = gather3(scene.camera, word + below), d = gather3(scene.camera, word + below + 3);
    mask seen = min_r(min_r(dot3(a, a), dot3(b, b)), min_r(dot3(c, c), dot3(d, d))) > 0.0f;
    real u = x - to_real(column), v = y - to_real(row);
    vec3 upper = madd3(b, u, scale3(a, 1.0f - u)), lower = madd3(d, u, scale3(c, 1.0f - u));
    vec3 w = sel3(seen, madd3(lower, v, scale3(upper, 1.0f - v)), v3(zero, zero, zero + 1.0f));
    CameraRay ray;
    ray.d = normalize3(matrix_vector(camera->to_world, w.x, w.y, w.z));
    ray.o = matrix_point(camera->to_world, zero, zero, zero);
    ray.far = sel(seen, (real)(FAR), (real)(1e-30f)); /* an unseen ray meets nothing */
    *weight = spectrum_sel(seen, spectrum_of(1.0f), spectrum_of(0.0f));
    return ray;
}
