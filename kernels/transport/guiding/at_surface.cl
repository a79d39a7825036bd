/* What a guide asks where a path meets a surface: it knows what falls on that, on the side of wo alone. */
#define GUIDE_COSINE 0.1f /* the least by which flux is divided for radiance */
#define GUIDE_LOBE LOBE_REFLECT
#define guide_row_at(scene, s, d) guide_row(scene, (s).p, sel3(dot3((s).n, d) < 0.0f, (s).n, neg3((s).n)))
#define guide_leads(wo, wi) ((wi).z * (wo).z > 0.0f)
#define guide_cosine(wi) max_r(fabs((wi).z), (real)(GUIDE_COSINE))
