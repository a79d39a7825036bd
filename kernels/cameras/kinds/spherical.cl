/* All directions from a point: longitude along x with +z in the middle and +x (left) at a quarter,
 * colatitude from +y down along y. What lies beyond the film's edges wraps round. */
CameraRay spherical_ray(global const SphericalCamera *camera, vec2 film, vec2 lens)
{
    real longitude = 0.5f - film.x, colatitude = 0.5f * film.y, sp, cp, st, ct;
    sincos_2pi(longitude - floor(longitude), &sp, &cp);
    sincos_2pi(colatitude - floor(colatitude), &st, &ct);
    real zero = 0.0f;
    CameraRay r;
    r.d = normalize3(matrix_vector(camera->to_world, st * sp, ct, st * cp));
    r.o = matrix_point(camera->to_world, zero, zero, zero);
    r.far = FAR;
    return r;
}
