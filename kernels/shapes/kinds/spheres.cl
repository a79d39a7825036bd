/* Many spheres in a single shape: the row at `params` of `geometry` has their orientation, `spheres` the centre and the
 * radius of each. Each sphere has the functions of kernels/shapes/kinds/sphere.cl. */

/* The sphere of primitive `prim`, where `active`; elsewhere the first sphere. */
inline Sphere spheres_one(Scene scene, integer params, integer prim, mask active)
{
    Sphere q = sphere_row(scene.geometry, params);
    integer at = 4 * sel_i(active, prim - scene.settings->single_count, (integer)(0));
    vec4 sphere = gather4(scene.spheres, at);
    q.center = v3(sphere.x, sphere.y, sphere.z);
    q.radius = sphere.w;
    return q;
}
