/* 0 and 1 alternate in cubes of unit size. */
inline real checkers_value(Checkers t, Scene scene, TexturePoint point)
{
    vec3 p = texture_transformed(scene, t.transform, point.p);
    real half_sum = 0.5f * (floor(p.x) + floor(p.y) + floor(p.z));
    return sel(half_sum == floor(half_sum), (real)(0.0f), (real)(1.0f));
}

Spectrum checkers_reflectance(Checkers t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_of(checkers_value(t, scene, point));
}

Spectrum checkers_emission(Checkers t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_grey_light(scene, checkers_value(t, scene, point), lambdas);
}

real checkers_real(Checkers t, Scene scene, TexturePoint point) { return checkers_value(t, scene, point); }
