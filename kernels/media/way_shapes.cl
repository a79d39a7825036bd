/* The medium along a ray to a light, by what shapes say of their sides. */
#define way_medium(scene, bodies, active, medium) (medium)
#define way_passage(scene, row, bodies, front, surfaces, own) (own)

/* Beyond a surface. */
inline integer way_onward(Scene scene, integer row, integer bodies, mask active, mask front, integer medium)
{
    ShapeMedia sides = shape_media(scene, row);
    return sel_i(active, medium_beyond(medium, sides.inside, sides.outside, front, front), medium);
}
