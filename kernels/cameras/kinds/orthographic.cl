/* Parallel rays along +z; the film spans [-1, 1] m in x before `to_world`, which may scale it. */
CameraRay orthographic_ray(global const OrthographicCamera *camera, vec2 film, vec2 lens)
{
    real x = 1.0f - 2.0f * film.x, y = (1.0f - 2.0f * film.y) * camera->aspect, z = 0.0f;
    CameraRay r;
    r.d = normalize3(matrix_vector(camera->to_world, z, z, z + 1.0f));
    r.o = matrix_point(camera->to_world, x, y, z + camera->near);
    r.far = camera->far - camera->near;
    return r;
}

/* Step screen: where parallel rays see a point; what is infinitely far is nowhere on the film. */
vec2 orthographic_screen(global const OrthographicCamera *camera, vec3 p, mask away, mask *seen)
{
    vec3 d = screen_point_back(camera->to_world, p);
    *seen = *seen & !away;
    return (vec2){0.5f - 0.5f * d.x, 0.5f - 0.5f * d.y / camera->aspect};
}
