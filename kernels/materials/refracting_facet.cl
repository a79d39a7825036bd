/* The facet that sends light from wi to wo, by reflection or by refraction (Walter et al. 2007, 4.2). */
typedef struct {
    vec3 h;        /* its normal, on the front */
    real o, i;     /* signed cosines of wo and wi to it */
    real jacobian; /* solid angle of normals per solid angle of wi, times |o| over that of wo */
    mask shading;   /* both directions see the facet from their own sides */
} RefractingFacet;

/* eta: index of the side of wi over that of wo; 1 for reflection. */
inline RefractingFacet refracting_facet(vec3 wo, vec3 wi, real eta)
{
    RefractingFacet p;
    mask reflected = wo.z * wi.z > 0.0f;
    vec3 h = normalize3(madd3(wi, eta, wo));
    p.h = scale3(h, sel(h.z < 0.0f, (real)(-1.0f), (real)(1.0f)));
    p.o = clamp_r(dot3(wo, p.h), (real)(-1.0f), (real)(1.0f));
    p.i = clamp_r(dot3(wi, p.h), (real)(-1.0f), (real)(1.0f));
    real refracted = sqr(eta) * fabs(p.i) / max_r(sqr(p.o + eta * p.i), (real)(1e-20f));
    p.jacobian = sel(reflected, 0.25f / max_r(fabs(p.o), (real)(1e-20f)), refracted);
    p.shading = (p.o * wo.z > 0.0f) & (p.i * wi.z > 0.0f);
    return p;
}

/* f |cos| of radiance that crosses a boundary with nothing lost but by Fresnel's reflection; index: of
 * the inside over the outside. */
inline real refracting_facet_transmitted(Microfacets d, vec3 wo, vec3 wi, real index)
{
    real eta = sel(wo.z > 0.0f, index, 1.0f / index);
    RefractingFacet p = refracting_facet(wo, wi, eta);
    real passed = (1.0f - fresnel_dielectric(p.o, index).f) / sqr(eta);
    real v = microfacet_visible_pdf(d, wo, p.h) * p.jacobian * microfacet_g1(d, wi, p.h) * passed;
    return sel(p.shading & (wo.z * wi.z < 0.0f), v, (real)(0.0f));
}
