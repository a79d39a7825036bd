/* Stands for transport/rival_chosen.cl where the chance of a light does not hang on where its light goes. */
#define rival_chosen(scene, path, at, v, r, receiver) (r)
