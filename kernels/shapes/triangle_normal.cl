/* The shading normal of a triangle whose mesh has normals. */
inline void triangle_normal(Scene scene, HitSpace space, Corners *c, Surface *s)
{
    if (any(c->smooth)) {
        vec3 a = corner_vec3(scene.normals, c->a, c->keys), b = corner_vec3(scene.normals, c->b, c->keys);
        vec3 ns = madd3(a, c->w, madd3(b, c->u, scale3(corner_vec3(scene.normals, c->c, c->keys), c->v)));
        mask usable = c->smooth & (dot3(ns, ns) > 1e-12f);
        c->normal = ns;
        s->ns = sel3(usable, normalize3(hit_normal(space, ns)), s->ns);
    }
}

/* Twin, in a scene whose meshes have no normals. */
inline void triangle_normal(Scene scene, HitSpace space, Corners *c, Surface *s) {}
