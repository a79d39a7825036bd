/* A list of rays: origin, unit direction and weight, 7 words each. Pixel i of the film, row by row, is entry i modulo
 * the count. */
CameraRay rays_ray(Scene scene, global const RaysCamera *camera, vec2 film, vec2 lens, Wavelengths lambdas,
                   Spectrum *weight)
{
    integer x = clamp_i(to_integer(film.x * (float)camera->columns), (integer)(camera->columns - 1));
    integer y = clamp_i(to_integer(film.y * (float)camera->rows), (integer)(camera->rows - 1));
    integer word = camera->list + 7 * ((y * camera->columns + x) % camera->count);
    real ray[7];
    for (int i = 0; i < 7; ++i) ray[i] = gather(scene.camera, word + i);
    CameraRay r = {v3(ray[0], ray[1], ray[2]), v3(ray[3], ray[4], ray[5]), (real)(FAR)};
    *weight = spectrum_of(ray[6]);
    return r;
}
