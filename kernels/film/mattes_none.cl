/* Stands for film/mattes.cl where there are none. */
#define mattes_record(scene, mattes, first, pixel_index, v)
