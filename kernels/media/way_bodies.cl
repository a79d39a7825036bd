/* The medium along a ray to a light, by the bodies that it is in. */
inline integer way_medium(Scene scene, integer bodies, mask active, integer medium)
{
    return body_medium(scene, bodies_top(sel_i(active, bodies, (integer)(0))));
}

/* What passes a surface: all, where a body of higher priority hides it. *bodies become those beyond. */
inline Passage way_passage(Scene scene, integer row, integer *bodies, mask front, int surfaces, Passage own)
{
    BodyBoundary boundary = body_boundary(scene, row, *bodies, front);
    *bodies = bodies_beyond(boundary, front);
    return passage_sel(boundary.hidden & mask_of(surfaces < MOST_NULL_SURFACES), passage_of(1.0f), own);
}

#define way_onward(scene, row, bodies, active, front, medium) way_medium(scene, bodies, active, medium)
