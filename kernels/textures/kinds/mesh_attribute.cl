/* Values that a mesh has per vertex or face, linear between the vertices of a triangle, or the shape `spheres` per
 * sphere. Spectra are interpolated as evaluated, not by their coefficients, as textures/kinds/bitmap.cl does between
 * texels. Where a shape has no such values the entry of its table is zero, and every index ends at its first word. */
inline integer mesh_attribute_at(MeshAttribute t, Scene scene, TexturePoint point, int corner, real *weight)
{
    integer entry = point.attributes + 2 * t.number, first = gather_i(scene.attributes, entry);
    integer vertex = texture_corner(scene, point, corner);
    *weight = corner == 0 ? 1.0f - point.b.x - point.b.y : corner == 1 ? point.b.x : point.b.y;
    return first + gather_i(scene.attributes, entry + 1) *
           sel_i((t.per_face != 0) & (point.face >= 0), point.face, vertex);
}

/* light: whether the values are emission. */
inline Spectrum mesh_attribute_spectrum(MeshAttribute t, Scene scene, TexturePoint point, int light,
                                        Wavelengths lambdas)
{
    Spectrum sum = spectrum_of(0.0f);
    for (int corner = 0; corner < 3; corner++) {
        real weight;
        integer at = mesh_attribute_at(t, scene, point, corner, &weight);
        vec4 row = gather_w4(scene.attributes, at);
        Spectrum value = light ? spectrum_light_texel(scene, row.x, row.y, row.z, row.w, lambdas)
                               : spectrum_texel(row.x, row.y, row.z, row.w, lambdas);
        sum = spectrum_madd(value, weight, sum);
    }
    return sum;
}

Spectrum mesh_attribute_reflectance(MeshAttribute t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return mesh_attribute_spectrum(t, scene, point, 0, lambdas);
}

Spectrum mesh_attribute_emission(MeshAttribute t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return mesh_attribute_spectrum(t, scene, point, 1, lambdas);
}

real mesh_attribute_real(MeshAttribute t, Scene scene, TexturePoint point)
{
    real sum = 0.0f;
    for (int corner = 0; corner < 3; corner++) {
        real weight;
        integer at = mesh_attribute_at(t, scene, point, corner, &weight);
        sum += weight * gather_w(scene.attributes, at);
    }
    return sum;
}
