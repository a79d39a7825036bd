/* Stands for media/medium_flies.cl where bodies absorb and nothing else. */
#define medium_extinction(scene, medium, row, a, lambdas) (a)
#define MEDIUM_LEFT(medium) (medium)
