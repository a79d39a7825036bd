/* The rays of a work-item's lanes and their ends, for sequential tracing: `at[i]` belongs to lane i. */
typedef union { real v; float at[LANES]; } TraceReal;
typedef union { integer v; int at[LANES]; } TraceInteger;
typedef struct { TraceReal ox, oy, oz, dx, dy, dz, t; } TraceRays;
typedef struct { TraceReal t, u, v, nx, ny, nz, plane, side; TraceInteger prim, tag; } TraceHits;
#define TRACE_RAY(r, i) (r)->ox.at[i], (r)->oy.at[i], (r)->oz.at[i], (r)->dx.at[i], (r)->dy.at[i], \
                        (r)->dz.at[i], 0.0f, (r)->t.at[i]

inline TraceRays trace_rays(vec3 o, vec3 d, real far)
{
    TraceRays r = {{o.x}, {o.y}, {o.z}, {d.x}, {d.y}, {d.z}, {far}};
    return r;
}

/* The lanes with a ray, in order, and their number. */
inline uint trace_active(mask active, uint *rays)
{
    TraceInteger is = {active};
    uint n = 0;
    for (uint i = 0; i < LANES; i++)
        if (is.at[i]) rays[n++] = i;
    return n;
}

inline TraceHits trace_missed(real far)
{
    TraceReal none = {(real)(0.0f)};
    TraceHits h = {{far}, none, none, none, none, none, none, none, {(integer)(-1)}, {(integer)(0)}};
    return h;
}

inline void trace_put(TraceHits *h, uint i, TriHit hit)
{
    h->t.at[i] = hit.t;
    h->u.at[i] = hit.u;
    h->v.at[i] = hit.v;
    h->nx.at[i] = hit.nx;
    h->ny.at[i] = hit.ny;
    h->nz.at[i] = hit.nz;
    h->plane.at[i] = hit.plane;
    h->side.at[i] = hit.side;
    h->prim.at[i] = as_int(hit.prim);
    h->tag.at[i] = as_int(hit.tag);
}

inline TraceHit trace_together(TraceHits h)
{
    TraceHit hit = {h.t.v, h.u.v, h.v.v, {h.nx.v, h.ny.v, h.nz.v}, h.plane.v, h.side.v, h.prim.v, h.tag.v};
    return hit;
}
