/* Stands for the media around lights where there are none. */
#define light_medium(scene, row) ((integer)(0))
#define medium_dims(scene, medium, t, lambdas, value) (value)
