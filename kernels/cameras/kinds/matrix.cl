/* Rays from the near plane [m] through the inverse of an OpenGL projection and view (clip y points up). */
CameraRay matrix_ray(global const MatrixCamera *camera, vec2 film, vec2 lens)
{
    real x = 2.0f * film.x - 1.0f, y = 1.0f - 2.0f * film.y;
#define AFFINE(name, i) (camera->name[i] + x * camera->name##_x[i] + y * camera->name##_y[i])
    real w = 1.0f / AFFINE(near, 3);
    CameraRay r;
    r.d = normalize3(v3(AFFINE(direction, 0), AFFINE(direction, 1), AFFINE(direction, 2)));
    r.o = v3(AFFINE(near, 0) * w, AFFINE(near, 1) * w, AFFINE(near, 2) * w);
    r.far = FAR;
#undef AFFINE
    return r;
}
