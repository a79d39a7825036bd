/* What a vertex asks of its material for a pair of directions. */
inline BsdfPair bsdf_pair(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio)
{
    BsdfPair pair;
    pair.f = bsdf_eval(m, wo, wi);
    pair.pdf = hero_pdf(m, wo, wi, ratio);
    pair.p = mis_pdf(m, wo, wi);
    pair.p_back = mis_pdf(m, wi, wo);
    return pair;
}

/* Sets the densities for MIS weights against paths from the other end. */
inline void pair_of_sample(Bsdf m, vec3 wo, BsdfSample *s)
{
    s->p = mis_pdf(m, wo, s->wi);
    s->p_back = mis_pdf(m, s->wi, wo);
}

/* Before a vertex takes the pair of wo and `wi`, or of wi and wo where light is carried (`adjoint`), and a sample. */
#define bsdf_ask(scene, scatter, wi, adjoint)
