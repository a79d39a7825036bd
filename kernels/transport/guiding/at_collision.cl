/* What a guide asks where a path collides in a medium: it knows the light of all directions, by no cosine. */
#include "transport/guiding/collision_row.cl"

#define GUIDE_LOBE LOBE_TRANSMIT
#define guide_row_at(scene, s, d) guide_row_of_collision(scene, (s).p)
#define guide_leads(wo, wi) mask_of(1)
#define guide_cosine(wi) ((real)(1.0f))
