/* Where the row of a point in a medium begins, which faces nowhere: see transport/guiding/guide.cl. */
#include "transport/guiding/bins.cl"
#include "transport/photons/cells.cl"

#define GUIDE_IN_MEDIUM 0x600d10c5 /* sets it apart from the faces of its cell */

inline integer guide_row_of_collision(Scene scene, vec3 p)
{
    return cell_number(scene, cell_at(scene, p, (real)(scene.settings->guide_side)), (integer)(GUIDE_IN_MEDIUM)) *
           GUIDE_BINS;
}
