/* The table `media`: first the aims of media/equiangular.cl; then, with light paths, two words for each row of
 * `lights`, the bodies around the light and the name of its medium; then two words for each shape. */
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS + 2 * scene.settings->light_count)
inline integer light_medium(Scene scene, integer row) { return gather_i(scene.media, 4 * MEDIUM_AIMS + 2 * row + 1); }
inline integer light_bodies(Scene scene, integer row) { return gather_i(scene.media, 4 * MEDIUM_AIMS + 2 * row); }

/* Twin, where no path starts at lights. */
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS)
inline integer light_medium(Scene scene, integer row) { return (integer)(0); }
