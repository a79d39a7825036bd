/* Owen-scrambled Sobol points, each pixel's its own. */
#include "lib/sobol.cl"
