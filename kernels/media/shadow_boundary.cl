/* Boundaries along a shadow ray among bodies: the word of bodies tells its medium. */
inline integer shadow_medium(Scene scene, integer bodies, mask active, integer medium)
{
    return body_medium(scene, bodies_top(sel_i(active, bodies, (integer)(0))));
}

/* The transmittance of a surface: 1 where a body of higher priority hides it. *bodies become the bodies beyond. */
inline Passage shadow_passage(Scene scene, integer row, integer *bodies, mask front, int surfaces, Passage own)
{
    BodyBoundary boundary = body_boundary(scene, row, *bodies, front);
    *bodies = bodies_beyond(boundary, front);
    return passage_sel(boundary.hidden & mask_of(surfaces < MOST_NULL_SURFACES), passage_of(1.0f), own);
}

#define shadow_medium_beyond(scene, row, bodies, active, front, medium) shadow_medium(scene, bodies, active, medium)

/* Twin, where bodies do not overlap: the interiors and exteriors of shapes tell its medium. */
inline integer shadow_medium(Scene scene, integer bodies, mask active, integer medium) { return medium; }
inline Passage shadow_passage(Scene scene, integer row, integer *bodies, mask front, int surfaces, Passage own)
{
    return own;
}

inline integer shadow_medium_beyond(Scene scene, integer row, integer bodies, mask active, mask front, integer medium)
{
    ShapeMedia sides = shape_media(scene, row);
    return sel_i(active, medium_beyond(medium, sides.inside, sides.outside, front, front), medium);
}
