/* Many spheres in one shape: the row at `params` of `geometry` says how all of them are turned, `spheres`
 * has the centre and the radius of each. Where one is has the functions of kernels/shapes/kinds/sphere.cl. */

/* The sphere that is primitive `prim`, where `active`; elsewhere the first. */
inline Sphere spheres_one(Scene scene, integer params, integer prim, mask active)
{
    Sphere q = sphere_row(scene.geometry, params);
    integer at = 4 * sel_i(active, prim - scene.settings->single_count, (integer)(0));
    vec4 sphere = gather4(scene.spheres, at);
    q.center = v3(sphere.x, sphere.y, sphere.z);
    q.radius = sphere.w;
    return q;
}
