/* Stands for transport/rival_dull.cl where all light paths go on from dull surfaces. */
#define rival_of_dull(third, p) (third)
