/* Many spheres in one shape that move by themselves: each has a row of `spheres` for every key, side by side, and its
 * centre and radius are linear in between. The word SPHERES_FIRST behind `params` of `geometry` says where in `spheres`
 * primitive 0 would be. What does not deform has one row for each. */

/* The sphere that is primitive `prim` at a time [s], where `active`; number: of the scene's shape. */
inline Sphere spheres_then(Scene scene, integer params, integer prim, integer number, real time, mask active)
{
    VertexKeys k = vertex_keys(scene, number, time);
    Sphere q = sphere_row(scene.geometry, params);
    integer first = gather_i(scene.geometry, params + SPHERES_FIRST);
    integer at = sel_i(active, first + 4 * (k.count * prim + k.key), (integer)(0));
    vec4 a = gather4(scene.spheres, at), b = gather4(scene.spheres, sel_i(active, at + 4 * k.next, (integer)(0)));
    real rest = 1.0f - k.share;
    q.center = madd3(v3(a.x, a.y, a.z), rest, scale3(v3(b.x, b.y, b.z), k.share));
    q.radius = a.w * rest + b.w * k.share;
    return q;
}

/* From a point p of a sphere at the scene's time to where it is at another, where `active` [m]. */
inline vec3 spheres_way(Scene scene, ShapeRow shape, integer prim, mask active, vec3 p, real time)
{
    integer params = sel_i(active, shape.params, (integer)(0)), number = sel_i(active, shape.number, (integer)(0));
    Sphere now = spheres_then(scene, params, prim, number, scene.time, active);
    Sphere then = spheres_then(scene, params, prim, number, time, active);
    real grown = then.radius / now.radius - 1.0f;
    return madd3(sub3(p, now.center), grown, sub3(then.center, now.center));
}
