/* The weight of a direction for light that is carried, see integrator/particle_tracer.cl; leaves: the cosine of the ray
 * that goes on over that of the one that arrives. */
inline Spectrum adjoint_weight(Vertex v, Scattering scatter, BsdfSample bs, mask next, real leaves)
{
    real over = max_r(fabs(bs.wi.z), (real)(1e-6f));
    real adjoint = BSDF_IS_PHASE ? (real)(1.0f) : bs.eta * bs.eta * leaves * fabs(scatter.wo.z) / over;
    Spectrum carried = spectrum_scale(bs.weight, adjoint);
#if BSDF_CHROMATIC && !BSDF_IS_PHASE /* eta differs between the wavelengths */
    mask spread = next & ((bs.lobe & LOBE_DELTA) == 0);
    Spectrum f = bsdf_eval(scatter.bsdf, bs.wi, scatter.wo);
    Spectrum exact = spectrum_scale(f, leaves / sel(spread, bs.pdf, (real)(1.0f)));
    carried = spectrum_sel(spread, exact, carried);
#endif
    return carried;
}
