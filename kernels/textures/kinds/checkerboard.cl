/* Two colours, each in two of the four quarters of a unit of uv. A colour is five words: a spectrum in
 * the form that parameters have, or for a real the number in the first of them. */
inline integer checkerboard_at(Checkerboard t, Scene scene, TexturePoint point)
{
    vec3 p = texture_uv(scene, t.mapping, t.transform, point);
    real u = dot3(t.to_u, p), v = dot3(t.to_v, p);
    mask same = (u - floor(u) > 0.5f) == (v - floor(v) > 0.5f);
    return sel_i(same, t.color0, t.color1);
}

Spectrum checkerboard_reflectance(Checkerboard t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return texture_constant(scene, checkerboard_at(t, scene, point), lambdas);
}

Spectrum checkerboard_emission(Checkerboard t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return checkerboard_reflectance(t, scene, point, lambdas);
}

real checkerboard_real(Checkerboard t, Scene scene, TexturePoint point)
{
    return gather_w(scene.textures, checkerboard_at(t, scene, point));
}
